"""Materials of glTF 2.0 and of its extensions for glass, as far as the fixed-function shader draws them."""

from .accessors import read_uri
from .error import SceneError
from .material import Material
from .texture import decode_texture, resampling_warning

__all__ = ["MATERIAL_EXTENSIONS", "GltfMaterials"]

#: Extensions whose effect is drawn, wholly or in part.
MATERIAL_EXTENSIONS = ("KHR_materials_emissive_strength", "KHR_materials_ior", "KHR_materials_specular",
                       "KHR_materials_transmission", "KHR_materials_unlit", "KHR_materials_volume")
_NOT_DRAWN = ("normalTexture", "occlusionTexture", "emissiveTexture", "metallicRoughnessTexture", "specularTexture",
              "transmissionTexture", "thicknessTexture")
_REPEAT, _NEAREST = 10497, 9728


def _unit(value):
    return min(max(float(value), 0.0), 1.0)


class GltfMaterials:
    """Reads the materials of a file; each thing that is not drawn becomes one warning.

    Parameters
    ----------
    root : Element
    accessors : Accessors
        Of the same file; images may lie in its buffers.
    folder : Path
        Images may not lie outside.
    warnings : list of str
    """

    def __init__(self, root, accessors, folder, warnings):
        self._root, self._accessors, self._folder, self._warnings = root, accessors, folder, warnings
        self._images, self._odd, self._resampled = {}, {}, []

    def load(self):
        """All materials of the file, in file order.

        Raises
        ------
        SceneError
            Naming the element that is wrong.
        """
        materials = [self._material(element) for element in self._root.list("materials")]
        for what, places in self._odd.items():
            more = f" and {len(places) - 1} more" if len(places) > 1 else ""
            self._warnings.append(f"{places[0]}{more}: {what} cannot be drawn; left out")
        self._warnings.extend(resampling_warning(self._resampled))
        return materials

    def _note(self, element, what):
        self._odd.setdefault(what, []).append(element.place)

    def _material(self, element):
        name = element.text("name", element.place)
        pbr, extensions = element.child("pbrMetallicRoughness"), element.child("extensions")
        color = pbr.reals("baseColorFactor", 4, [1.0] * 4) if pbr else [1.0] * 4
        metallic = _unit(pbr.real("metallicFactor", 1.0)) if pbr else 1.0
        roughness = _unit(pbr.real("roughnessFactor", 1.0)) if pbr else 1.0
        texture = self._texture(pbr.child("baseColorTexture")) if pbr else None
        emission = [_unit(channel) for channel in element.reals("emissiveFactor", 3, [0.0] * 3)]
        mode = element.text("alphaMode", "OPAQUE").lower()
        if mode not in ("opaque", "mask", "blend"):
            raise element.error(f"alphaMode '{mode.upper()}' is unknown; use OPAQUE, MASK or BLEND")

        def extension(key):
            found = extensions.child(key) if extensions else None
            if found:
                self._note_textures(found)
            return found

        for key in extensions.data if extensions else ():
            if key not in MATERIAL_EXTENSIONS:
                self._note(element, f"extension {key}")
        for part in (element, pbr):
            if part:
                self._note_textures(part)
        if pbr and "metallicRoughnessTexture" in pbr.data:
            # Factors beside such a texture are mostly 1 and mean nothing without it: take a plain surface.
            metallic, roughness = 0.0, max(roughness, 0.6)
        ior, transmission = extension("KHR_materials_ior"), extension("KHR_materials_transmission")
        volume, strength = extension("KHR_materials_volume"), extension("KHR_materials_emissive_strength")
        dielectric = extension("KHR_materials_specular")
        index = max(ior.real("ior", 1.5), 1e-3) if ior else 1.5
        through = _unit(transmission.real("transmissionFactor", 0.0)) * (1 - metallic) if transmission else 0.0
        if strength:
            emission = [_unit(channel * strength.real("emissiveStrength", 1.0)) for channel in emission]
        rgb = tuple(_unit(channel) for channel in color[:3])
        common = dict(texture=texture, opacity=_unit(color[3]), alpha_mode=mode,
                      alpha_cutoff=_unit(element.real("alphaCutoff", 0.5)))
        if extension("KHR_materials_unlit"):
            # Emission has no texture, so a textured one is drawn as a matt one.
            if texture is not None:
                self._note(element, "a texture that is not lit")
                return Material(name, rgb, **common)
            return Material(name, (0.0, 0.0, 0.0), emission=rgb, **common)
        facing = ((index - 1) / (index + 1)) ** 2 * (_unit(dielectric.real("specularFactor", 1.0)) if dielectric else 1)
        # GGX's width α = roughness² and Blinn's exponent 2/α² − 2; about the mirrored direction it is a quarter.
        blinn = 2 / max(roughness, 0.03) ** 4 - 2
        strongest = metallic + (1 - metallic) * facing
        mirror = metallic * (1 - roughness)
        return Material(
            name, rgb, emission=tuple(emission), specular=_unit(strongest * (blinn + 2) / 8), shininess=blinn / 4,
            reflection=facing if through else mirror, fresnel=through > 0, tinted=metallic >= 0.5, transmission=through,
            ior=index, thin=volume is None or volume.real("thicknessFactor", 0.0) <= 0, **common)

    def _note_textures(self, element):
        for key in _NOT_DRAWN:
            if key in element.data:
                self._note(element, key)

    def _texture(self, reference):
        """Texture that a textureInfo names, or None."""
        if reference is None:
            return None
        if reference.whole("texCoord", 0):
            self._note(reference, "a second set of texture coordinates")
        extensions = reference.child("extensions")
        for key in extensions.data if extensions else ():
            self._note(reference, f"extension {key}")
        texture = reference.refer("index", "textures")
        if "source" not in texture.data:
            self._note(texture, "an image that only an extension names")
            return None
        number = texture.index("source", "images")
        nearest = False
        if "sampler" in texture.data:
            sampler = texture.refer("sampler", "samplers")
            nearest = sampler.whole("magFilter", 0) == _NEAREST
            if any(sampler.whole(key, _REPEAT) != _REPEAT for key in ("wrapS", "wrapT")):
                self._note(sampler, "a wrap mode other than repeat")
        if (number, nearest) not in self._images:
            self._images[number, nearest] = self._image(texture.refer("source", "images"), filtered=not nearest)
        return self._images[number, nearest]

    def _image(self, image, *, filtered):
        uri = image.text("uri", None)
        if uri is None:
            data = self._accessors.view_bytes(image.refer("bufferView", "bufferViews"))
        else:
            data = read_uri(image, uri, self._folder)
        try:
            return decode_texture(data, image.text("name", uri if uri and len(uri) < 80 else image.place),
                                  self._resampled, filtered=filtered)
        except SceneError as error:
            raise image.error(error) from None
