"""A second full shader, recursive, in plain numpy, written from docs/shading.md: slow, and simple to check by eye."""

import math

import numpy as np

__all__ = ["Reference"]


def decoded(byte):
    e = np.asarray(byte) / 255
    return np.where(e <= 0.04045, e / 12.92, ((e + 0.055) / 1.055) ** 2.4)


def stored(linear):
    """A linear colour after sRGB bytes."""
    linear = np.asarray(linear, float)
    return decoded(np.rint(255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)))


def share(value):
    return round(255 * value) / 255


def hued(light):
    """A light's colour after its hue was kept in linear bytes."""
    most = max(light)
    return np.rint(255 * np.array(light) / most) / 255 * most if most else np.zeros(3)


def normalised(vector):
    return vector / np.linalg.norm(vector)


def ulp(*points):
    return 2.0 ** (math.floor(math.log2(max(np.abs(point).max() for point in points))) - 52)


class Reference:
    """Colours of rays in a scene; all triangles are tested with every ray, in world space."""

    def __init__(self, scene, *, depth, background=(0, 0, 0)):
        self.scene, self.depth, self.background = scene, depth, decoded(background)
        self.owners = [(i, p) for i, instance in enumerate(scene.instances)
                       for p in range(scene.meshes[instance.mesh].num_triangles)]
        self.corners = np.concatenate([
            scene.meshes[instance.mesh].vertices[scene.meshes[instance.mesh].triangles]
            @ instance.transform[:, :3].T + instance.transform[:, 3] for instance in scene.instances])

    def closest(self, origin, direction, t_near, skip):
        """(t, u, v, number) of the nearest triangle beyond ``t_near``, or None."""
        edge1, edge2 = self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0]
        p = np.cross(direction, edge2)
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = 1 / (p * edge1).sum(axis=1)
            u = ((origin - self.corners[:, 0]) * p).sum(axis=1) * scale
            q = np.cross(origin - self.corners[:, 0], edge1)
            v = q @ direction * scale
            t = (q * edge2).sum(axis=1) * scale
        t[~((u >= 0) & (v >= 0) & (u + v <= 1) & (t > t_near))] = math.inf
        if skip is not None:
            t[skip] = math.inf
        number = int(t.argmin())
        return None if t[number] == math.inf else (t[number], u[number], v[number], number)

    def look(self, hit):
        """(material, colour, opacity)."""
        _, u, v, number = hit
        instance, prim = self.owners[number]
        mesh = self.scene.meshes[self.scene.instances[instance].mesh]
        material = self.scene.materials[mesh.material_ids[prim]]
        color, opacity = stored(material.base_color), share(material.opacity)
        if material.texture is not None and mesh.uvs is not None:
            texel = self.texel(material.texture, np.array((1 - u - v, u, v)) @ mesh.uvs[prim])
            color, opacity = color * texel[:3], opacity * texel[3]
        if material.alpha_mode == "opaque":
            opacity = 1.0
        elif material.alpha_mode == "mask":
            opacity = float(opacity >= share(material.alpha_cutoff))
        return material, color, opacity

    def texel(self, texture, uv):
        height, width = texture.pixels.shape[:2]
        if not texture.filtered:
            texel = texture.pixels[math.floor(uv[1] * height) % height, math.floor(uv[0] * width) % width]
            return np.array([*decoded(texel[:3]), texel[3] / 255])
        x, y = uv[0] * width - 0.5, uv[1] * height - 0.5
        i, j = math.floor(x), math.floor(y)
        f, g = x - i, y - j
        total = np.zeros(4)
        for column, row, weight in ((i, j, (1 - f) * (1 - g)), (i + 1, j, f * (1 - g)), (i, j + 1, (1 - f) * g),
                                    (i + 1, j + 1, f * g)):
            texel = texture.pixels[row % height, column % width]
            total += weight * np.array([*decoded(texel[:3]), texel[3] / 255])
        return total

    def sky(self, direction):
        if self.scene.sky is None:
            return self.background
        x, y, z = direction / np.abs(direction).sum()
        if z < 0:
            x, y = (1 - abs(y)) * (1 if x >= 0 else -1), (1 - abs(x)) * (1 if y >= 0 else -1)
        pixels = self.scene.sky.pixels
        size = len(pixels)
        x, y = (x + 1) / 2 * size - 0.5, (y + 1) / 2 * size - 0.5
        i, j = math.floor(x), math.floor(y)
        total = np.zeros(3)
        for column, row in ((i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)):
            weight = (1 - abs(x - column)) * (1 - abs(y - row))
            if not 0 <= column < size:
                column, row = min(max(column, 0), size - 1), size - 1 - row
            if not 0 <= row < size:
                column, row = size - 1 - column, min(max(row, 0), size - 1)
            total += weight * decoded(pixels[row, column])
        return total

    def visible(self, origin, direction, t_far, lit):
        """What of the light gets from the origin to ``t_far``."""
        passed, t_near, skip = np.ones(3), 0.0, [lit]
        for _ in range(65):
            hit = self.closest(origin, direction, t_near, skip)
            if hit is None or not hit[0] < t_far:
                return passed
            material, color, opacity = self.look(hit)
            through = opacity * share(material.transmission) * (1 - share(material.reflection))
            passed = passed * (1 - opacity + through * color)
            if not passed.any():
                break
            t_near, skip = hit[0], [lit, hit[3]]
        return np.zeros(3)

    def lighting(self, point, origin, normal, mirrored, length, exponent, number):
        diffuse, specular = np.zeros(3), np.zeros(3)
        for light in self.scene.lights:
            strength = hued(light.color) * light.intensity
            if light.kind == "directional":
                travel, distance = light.direction, 1.0
            else:
                travel = point - light.position
                distance = np.linalg.norm(travel)
                bound = 1 / light.radius**2 if light.radius else math.inf
                strength = strength * min(1 / distance**2, bound) * max(0, 1 - (distance / light.reach) ** 4)
            if light.kind == "spot":
                scale, offset, squarings = light.cone
                inside = min(max(travel @ light.direction / distance * scale + offset, 0), 1)
                strength = strength * inside ** 2**squarings
            cosine = -(normal @ travel) / distance
            if cosine <= 0 or not strength.any():
                continue
            if light.kind == "directional":
                seen = self.visible(point + 8 * ulp(point, origin) * normal, -travel, math.inf, number)
            else:
                seen = self.visible(light.position, travel, 1 - 8 * ulp(light.position, point) / distance, number)
            diffuse += seen * strength * cosine
            specular += seen * strength * max(0, -(mirrored @ travel) / distance / length) ** exponent
        return diffuse, specular

    def color(self, origin, direction, weight=None, depth=0, t_near=0.0, skip=None):
        """What a ray sees; rays whose path has the product of weights ``weight`` below 2⁻¹² are not followed."""
        weight = np.ones(3) if weight is None else weight
        if depth > self.depth or weight.max() < 2**-12:
            return np.zeros(3)
        for _ in range(65):
            hit = self.closest(origin, direction, t_near, skip)
            if hit is None:
                return self.sky(direction)
            t, u, v, number = hit
            material, color, opacity = self.look(hit)
            if opacity:
                break
            t_near, skip = t, number
        else:
            return np.zeros(3)
        instance, prim = self.owners[number]
        placed = self.scene.instances[instance]
        mesh = self.scene.meshes[placed.mesh]
        v0, v1, v2 = mesh.vertices[mesh.triangles[prim]]
        to_world = np.linalg.inv(placed.transform[:, :3]).T
        flat = normalised(to_world @ np.cross(v1 - v0, v2 - v0))
        normal = flat
        if mesh.normals is not None:
            given = [normalised(n) for n in mesh.normals[prim]]
            normal = normalised(to_world @ ((1 - u - v) * given[0] + u * given[1] + v * given[2]))
        front = direction @ flat < 0
        if not front:
            flat, normal = -flat, -normal

        length, point = np.linalg.norm(direction), origin + t * direction
        mirrored = direction - 2 * (direction @ normal) * normal
        steady = normal if direction @ normal < 0 else flat
        c = direction @ steady
        share_through, share_mirror = share(material.transmission), share(material.reflection)
        eta = 1.0
        if share_through and not material.thin:
            eta = 1 / material.ior if front else material.ior
        square = length**2 - eta**2 * (length**2 - c**2)
        cosine = -c / length if eta <= 1 else math.sqrt(max(square, 0)) / length
        if material.fresnel:
            share_mirror += (1 - share_mirror) * (1 - cosine) ** 5
        through, local = (1 - share_mirror) * share_through, (1 - share_mirror) * (1 - share_through)
        if square < 0:
            share_mirror, through = share_mirror + through, 0.0
        tint = color if material.tinted else np.ones(3)
        exponent = 2 ** min(max(round(math.log2(max(material.shininess, 1))), 0), 10)
        diffuse, specular = self.lighting(point, origin, normal, mirrored, length, exponent, number)
        total = opacity * (stored(material.emission) + local * color * (hued(self.scene.ambient) + diffuse)
                           + share(material.specular) * tint * specular)
        e = 8 * ulp(point, origin)
        for factor, start, way, near in (
                (opacity * share_mirror * tint, point + e * steady, direction - 2 * c * steady, 0.0),
                (opacity * through * color, point - e * steady,
                 eta * direction - (eta * c + math.sqrt(max(square, 0))) * steady, 0.0),
                ((1 - opacity) * np.ones(3), origin, direction, t)):
            if factor.any():
                total = total + factor * self.color(start, way, weight * factor, depth + 1, near, number)
        return total
