"""Moving scenes in memory: two slots, what is uploaded for a frame, and that nothing else changes."""

from dataclasses import fields, replace

import numpy as np
import pytest

from fpu import FloatFormat
from rtl.config import ChipConfig
from rtl.program.records import FIRST_MATRIX
from sim.model import render_full, render_model
from sim.scene import Light, Material, Scene, SceneError, load_scene
from sim.scene.compile import CompiledScene
from sim.scene.image import SceneImage
from sim.scene.scene import IDENTITY, Instance
from sim.scene.slots import MemoryLayout

from ..golden.rooms import ball, quad, scene_of

FORMAT = FloatFormat(7, 16)
SIZE = 40, 30
MEMORIES = "nodes", "lists", "matrices", "shading", "records", "texels"


def picture(image, camera):
    if image.records is None:
        return render_model(image, camera, *SIZE, config=ChipConfig())
    return render_full(image, camera, *SIZE, config=ChipConfig(), depth=2)


@pytest.fixture(scope="module")
def walk():
    scene = load_scene("walk")
    poses = [scene.at_time(t) for t in (0.0, 2.6, 3.9)]
    return poses, [pose.default_camera() for pose in poses], CompiledScene(scene, fmt=FORMAT)


@pytest.mark.parametrize("is_full", [False, True])
def test_slots_draw_what_an_image_without_slots_draws(walk, is_full):
    poses, cameras, compiled = walk
    for pose, camera in zip(poses, cameras, strict=True):
        view = {"eye": camera.eye, "is_full": is_full}
        plain = picture(compiled.image(pose, **view), camera)
        assert (plain.prim_id >= 0).mean() > 0.9
        for slot in (0, 1):
            assert not picture(compiled.image(pose, **view, slot=slot), camera).differs(plain).any()


def changed(before, after):
    """Numbers of the items of each memory that are not the same in two images."""
    result = {}
    for name in MEMORIES:
        old, new = getattr(before, name), getattr(after, name)
        if old is not None:
            assert old.shape == new.shape
            result[name] = np.flatnonzero((old != new).reshape(len(old), -1).any(axis=1))
    return result


def within(numbers, first, count):
    return len(numbers) > 0 and (numbers >= first).all() and (numbers < first + count).all()


@pytest.mark.parametrize("is_full", [False, True])
def test_an_update_touches_its_own_slot(walk, is_full):
    poses, cameras, compiled = walk
    layout = compiled.slots
    assert layout.num_instances == 10
    images = [compiled.image(poses[0], eye=cameras[0].eye, is_full=is_full, slot=0)]
    for number, (pose, camera) in enumerate(zip(poses[1:], cameras[1:], strict=True), 1):
        slot, view = number & 1, {"eye": camera.eye, "is_full": is_full}
        update = compiled.update(pose, slot=slot, **view)
        images.append(images[-1].updated(update))
        # Early enough for the last frame: it still draws the same with all that is written ahead.
        ahead = images[-2].updated(replace(update, between=(), root=images[-2].root, center=images[-2].center,
                                           scale=images[-2].scale))
        before = cameras[number - 1]
        assert not picture(ahead, before).differs(picture(images[-2], before)).any()
        whole = compiled.image(pose, **view, slot=slot)
        assert not picture(images[-1], camera).differs(picture(whole, camera)).any()

        found = changed(images[-2], images[-1])
        assert within(found["nodes"], layout.first_node(slot), layout.top_nodes)
        assert within(found["lists"], layout.first_entry(slot), layout.top_entries)
        assert within(found["matrices"], layout.first_instance(slot), 10)
        assert not len(found["shading"])
        sizes = {name: getattr(images[-1], name)[0].nbytes for name in ("nodes", "lists", "matrices")}
        for name, size in sizes.items():
            assert len(found[name]) * size <= update.bytes_ahead[name] <= 3000
        if is_full:
            lights = images[-1].record_lanes()[1][0, 9]
            records = found["records"]
            assert records[0] == 0
            assert update.bytes_between == {"records": 36}
            own = (records >= FIRST_MATRIX + 10 * slot) & (records < FIRST_MATRIX + 10 * slot + 10)
            assert (own | (records >= lights) & (records < lights + 15))[1:].all()
            assert lights == compiled.image(poses[0], **view, slot=0).record_lanes()[1][0, 9] + 15 * slot
            assert not len(found["texels"])
            assert update.bytes_ahead["records"] == 36 * (10 + 15)
        else:
            assert update.bytes_between == {}
    # What the first frame's slot had is gone, so all three are there.
    assert {image.root for image in images} == {layout.first_node(0), layout.first_node(1)}


def test_what_stays_is_shared(walk):
    poses, cameras, compiled = walk
    image = compiled.image(poses[0], eye=cameras[0].eye, is_full=True, slot=0)
    after = image.updated(compiled.update(poses[1], slot=1, eye=cameras[1].eye, is_full=True))
    assert after.texels is image.texels
    assert after.triangle_prim is image.triangle_prim
    assert after.needs == image.needs
    assert {field.name for field in fields(SceneImage)} >= set(MEMORIES)


def test_layout():
    layout = MemoryLayout(2, 3, 8, 5)
    assert [layout.first_instance(slot) for slot in (0, 1)] == [0, 3]
    # Siblings are at an even number and the one after it.
    assert [layout.first_node(slot) for slot in (0, 1)] == [6, 14]
    assert [layout.first_entry(slot) for slot in (0, 1)] == [0, 5]
    assert (layout.static_node, layout.static_entry, layout.static_matrix) == (22, 10, 6)
    assert MemoryLayout(1, 3, 8, 5).first_node(0) == 4


def balls(number, **others):
    """So many balls in one place, and a mesh of which nothing can be hit among them."""
    mesh, material = ball((0, 0, 0), 0.5, Material("m", (0.9, 0.5, 0.2)), num_rings=6)
    nothing = replace(mesh, triangles=mesh.triangles[:0], material_ids=mesh.material_ids[:0])
    instances = [Instance(0, IDENTITY, f"ball {k}") for k in range(number)]
    return Scene([mesh, nothing], [instances[0], Instance(1, IDENTITY, "none"), *instances[1:]], [material], **others)


def scattered(number, instance, t):
    """A grid of them, at t = 1."""
    place = 3.0 * t * np.array([number % 6, number // 6 % 6, number // 36])
    return np.column_stack([np.eye(3), place])


def test_a_tree_that_outgrows_its_slot_is_kept_shallower():
    scene = balls(150)
    compiled = CompiledScene(scene, fmt=FORMAT, flatten=False)
    spread = scene.at_time(1.0, move=scattered)
    layout, plain = compiled.slots, compiled.image(spread)
    # The scene as compiled needs a single leaf.
    assert len(plain.nodes) - len(compiled.image(scene).nodes) > layout.top_nodes
    update = compiled.update(spread, slot=1)
    assert update.is_cut
    assert not compiled.update(scene, slot=1).is_cut
    nodes, lists, _ = update.ahead
    assert nodes.first == layout.first_node(1)
    assert 2 < len(nodes.items) <= layout.top_nodes
    assert 150 <= len(lists.items) <= layout.top_entries
    camera = spread.default_camera()
    image = compiled.image(scene, slot=0).updated(update)
    frame = picture(image, camera)
    assert not frame.differs(picture(plain, camera)).any()
    assert (frame.instance_id > 1).any()


def test_instances_are_placed_as_seen_from_the_eye():
    scene = balls(150).at_time(1.0, move=scattered)
    # Where the scene's middle is far and a ball is near.
    eye = scene.instances[40].transform[:, 3] + (0.1, 0.2, 0.7)
    image = CompiledScene(scene, fmt=FORMAT, flatten=False).image(scene, eye=eye)
    assert (image.center == eye).all()
    assert np.log2(image.scale) % 1 == 0
    places = image.matrix_values()[:image.num_instances, 3] / image.scale
    true = np.array([scene.instances[number].transform[:, 3] for number in image.instance_ids]) - eye
    assert len(places) == 150
    # Rounded once, seen from there; a ball's middle is computed.
    assert (np.abs(places - true) <= 2.0 ** -17 * np.abs(true) + 1e-12).all()
    assert np.abs(image.scale * (np.array(scene.bounds()) - eye)).max() <= 1
    middle = CompiledScene(scene, fmt=FORMAT, flatten=False, from_eye=False).image(scene, eye=eye).center
    assert np.allclose(middle, np.mean(scene.bounds(), axis=0))


def test_flat_scenes_update_lights_alone():
    mesh = quad([(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)], Material("m", (1, 1, 1)))
    light = Light("point", position=(1, 1, 1), radius=0.5)
    scene = scene_of(mesh, lights=[light])
    compiled = CompiledScene(scene, fmt=FORMAT)
    assert compiled.is_flat
    view = {"eye": (0, 0, 4), "is_full": True}
    image = compiled.image(scene, slot=0, **view)
    moved = replace(scene, lights=[replace(light, position=(0.2, 1, 1))])
    update = compiled.update(moved, slot=1, **view)
    assert update.bytes_ahead == update.bytes_between == {"records": 36}
    camera = scene.default_camera()
    frame = picture(image.updated(update), camera)
    assert not frame.differs(picture(compiled.image(moved, **view), camera)).any()
    assert frame.differs(picture(image, camera)).any()
    assert compiled.update(moved, slot=1).ahead == ()


def test_errors():
    scene = scene_of(quad([(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)], Material("m", (1, 1, 1))))
    compiled = CompiledScene(scene, fmt=FORMAT)
    moved = scene.at_time(1.0, move=lambda number, instance, t: np.eye(3, 4) * 2)
    says = (r"instance '.*' moves, but the scene is flat: all triangles lie in one space; compile it with "
            r"flatten=False \(dynrt: --instances\)")
    for draw in (compiled.image, lambda scene: compiled.update(scene, slot=1)):
        with pytest.raises(SceneError, match=says):
            draw(moved)
    brighter = replace(scene, lights=[Light("point"), Light("point")])
    with pytest.raises(SceneError, match=r"scene has 2 lights, but had 1 when it was compiled; compile it anew"):
        compiled.update(brighter, slot=0, eye=(0, 0, 4), is_full=True)
    for draw in (compiled.image, lambda scene, **options: compiled.update(scene, slot=0, **options)):
        with pytest.raises(ValueError, match=r"^full shading needs the eye$"):
            draw(scene, is_full=True)


def test_moved_by_a_function():
    scene, asked = balls(3), []

    def move(number, instance, t):
        asked.append((number, instance.name, t))
        return np.column_stack([np.eye(3) * 2, (0, t, 0)]) if instance.name == "ball 1" else None

    posed = scene.at_time(0.5, move=move)
    assert asked == [(0, "ball 0", 0.5), (1, "none", 0.5), (2, "ball 1", 0.5), (3, "ball 2", 0.5)]
    assert posed.instances[2].transform.tolist() == [[2, 0, 0, 0], [0, 2, 0, 0.5], [0, 0, 2, 0]]
    assert posed.instances[0] is scene.instances[0]
    assert posed.meshes is scene.meshes


def test_a_function_moves_on_from_the_key_frames():
    scene = load_scene("walk")
    names = [instance.name for instance in scene.instances]
    drone, still = names.index("drone 0"), scene.at_time(2.0)
    lifted = scene.at_time(2.0, move=lambda number, instance, t: (
        instance.transform + [[0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 1]] if number == drone else None))
    assert (lifted.instances[drone].transform - still.instances[drone].transform)[:, 3].tolist() == [0, 0, 1]
    assert (lifted.instances[0].transform == still.instances[0].transform).all()


@pytest.mark.parametrize(("result", "says"), [
    (np.eye(4), r"node 'ball 0' \(instance 0\): what moves it must return a 3×4 matrix \[A \| b\] or None: "
     r"of shape \(4, 4\)"),
    ("there", r"node 'ball 0' \(instance 0\): what moves it must return a 3×4 matrix .*there"),
    (np.zeros((3, 4)), r"node 'ball 0' \(instance 0\): transform is singular"),
    (np.full((3, 4), np.nan), r"node 'ball 0' \(instance 0\): transform has a value that is not finite"),
])
def test_a_function_that_returns_no_transform(result, says):
    with pytest.raises(SceneError, match=says):
        balls(1).at_time(0.0, move=lambda number, instance, t: result)
