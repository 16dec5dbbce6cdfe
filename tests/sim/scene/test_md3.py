"""Models of Quake III: poses, tags, skins, and players put together from them."""

import re

import numpy as np
import pytest

from sim.scene import SceneError, load_scene
from sim.scene.md3 import Md3
from sim.scene.pk3 import Archive
from sim.scene.quake_player import Wardrobe, load_md3, player_mesh
from sim.scene.quake_players import floors, quake_players_scene

from .quake_builder import CORNERS, UPRIGHT, corners, md3, picture, pk3, small_player, surface

FRAMES = [CORNERS, [(x, y, z - 1.5) for x, y, z in CORNERS]]


def triangle(name="Part", *, shader="skin.tga", frames=FRAMES, normals=((0, 0), (64, 0), (64, 64)),
             triangles=((0, 2, 1),)):
    return surface(name, shader=shader, frames=frames, normals=normals, uvs=[(0, 0), (1, 0), (0, 0.5)],
                   triangles=triangles)


def tag(origin=(1, 2, 3), axes=UPRIGHT):
    return [("tag_a", origin, axes)]


def test_surfaces():
    model = Md3(md3([triangle(), triangle("other", shader="")], num_frames=2), "m")
    part, other = model.surfaces(1)
    assert (part.name, part.shader, other.name, other.shader) == ("part", "skin.tga", "other", "")
    assert part.vertices.tolist() == [[0, 0, -1.5], [1, 0, -1.5], [0, 1, -1.5]]
    # The file winds clockwise as seen from above.
    assert part.triangles.tolist() == [[1, 2, 0]]
    assert part.uvs.tolist() == [[0, 0], [1, 0], [0, 0.5]]
    assert part.normals == pytest.approx(np.array([(0, 0, 1), (1, 0, 0), (0, 1, 0)]), abs=1e-12)
    assert model.surfaces(0)[0].vertices.tolist() == [list(map(float, corner)) for corner in CORNERS]


def test_tags_are_of_length_one():
    turned = ((0, 2, 0), (-0.5, 0, 0), (0, 0, 1))
    model = Md3(md3([triangle()], num_frames=2, tags=[tag(), tag((4, 5, 6), turned)]), "m")
    assert model.tags(0)["tag_a"].tolist() == [[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3]]
    # The first axis is the image of x.
    assert model.tags(1)["tag_a"].tolist() == [[0, -1, 0, 4], [1, 0, 0, 5], [0, 0, 1, 6]]


@pytest.fixture
def archive(tmp_path):
    """Function from changes of the small player's files to an archive with it."""
    def write(**changes):
        files = small_player() | {f"models/players/toy/{name.replace('_cfg', '.cfg')}": data
                                  for name, data in changes.items()}
        (tmp_path / "a.pk3").write_bytes(pk3({name: data for name, data in files.items() if data is not None}))
        return Archive(tmp_path / "a.pk3")

    return write


def test_a_player(archive):
    files = archive()
    wardrobe = Wardrobe(files)
    mesh = player_mesh(files, "toy", wardrobe, legs=1, torso=1)
    legs, torso, head = corners(mesh)
    # Legs at frame 1: raised by 1.
    assert legs.tolist() == [[1, 0, 1], [0, 1, 1], [0, 0, 1]]
    # The upper body, raised by 1 itself, on a tag at height 2 + 1, turned: (x, y) → (−y, x).
    assert torso == pytest.approx(np.array([(0, 1, 4), (-1, 0, 4), (0, 0, 4)]))
    # The head on a tag at height 1 + 1 of the upper body, which is at 3.
    assert head == pytest.approx(np.array([(0, 1, 5), (-1, 0, 5), (0, 0, 5)]))
    assert [wardrobe.materials[i].texture.pixels[0, 0, :3].tolist() for i in mesh.material_ids] == [
        [200, 0, 0], [200, 0, 0], [0, 200, 0]]
    assert (mesh.normals == (0, 0, 1)).all()


def test_a_player_stands_by_its_animation_cfg(archive):
    firsts = [0] * 25
    # Legs begin with 90 in the file, the gesture with 70: by 20 less in the model.
    firsts[6], firsts[11], firsts[13], firsts[22] = 70, 1, 90, 22
    cfg = "sex m // words\n" + "".join(f"{first}\t1 0 15 // some\n" for first in firsts)
    files = archive(animation_cfg=cfg.encode())
    mesh = player_mesh(files, "toy", Wardrobe(files))
    assert corners(mesh)[:, 0, 2].tolist() == [2, 5, 6]


def test_a_scene_of_a_player(archive, tmp_path):
    archive()
    scene = load_scene(f"{tmp_path}/a.pk3:TOY")
    assert (scene.num_triangles, scene.warnings) == (3, [])


def test_a_missing_tag_is_warned_of(archive, tmp_path):
    files = archive(**{"upper.md3": md3([triangle()], num_frames=2)})
    warnings = []
    mesh = player_mesh(files, "toy", Wardrobe(files), warnings=warnings)
    assert warnings == ["models/players/toy/upper.md3: has no tag_head; what is joined on there stands at its origin"]
    assert corners(mesh)[2, 0].tolist() == pytest.approx([0, 1, 2])
    joined = player_mesh(files, "toy", Wardrobe(files), joints={"tag_head": (5, 0, 1), "tag_torso": (9, 9, 9)})
    assert corners(joined)[2, 0].tolist() == pytest.approx([0, 6, 3])


def test_the_nearest_level_of_detail(archive):
    fine, coarse = (md3([triangle(triangles=((0, 2, 1),) * count)], num_frames=2) for count in (5, 2))
    files = archive(**{"head_1.md3": fine, "head_2.md3": coarse})
    assert [player_mesh(files, "toy", Wardrobe(files), level=level).num_triangles for level in range(3)] == [3, 7, 4]


@pytest.mark.parametrize(("changes", "message"), [
    ({"head.md3": None}, "player 'toy' has no models/players/toy/head.md3"),
    ({"head.md3": b"IDP2"}, "models/players/toy/head.md3: not a model of Quake III (MD3, version 15)"),
    ({"lower.md3": md3([], num_frames=0)},
     "models/players/toy/lower.md3: has no frame 0; there are 0, numbered from 0"),
    ({"animation_cfg": b"1 2 3 4\n"}, "models/players/toy/animation.cfg: has 1 lines of four numbers; a player has 25"),
    ({"animation_cfg": b"7 1 1 1\n" * 25},
     "models/players/toy/lower.md3: has no frame 7; there are 3, numbered from 0"),
])
def test_bad_players(archive, tmp_path, changes, message):
    archive(**changes)
    with pytest.raises(SceneError, match=f"^{re.escape(f'{tmp_path}/a.pk3: {message}')}$"):
        load_scene(f"{tmp_path}/a.pk3:toy")


@pytest.fixture
def folder(tmp_path):
    """A game's folder, unpacked, with a model."""
    path = tmp_path / "base" / "models" / "Things"
    path.mkdir(parents=True)
    (path / "thing_1.md3").write_bytes(md3([triangle(), triangle("bare", shader="")], num_frames=2))
    (path / "thing_default.skin").write_text("PART, models/things/RED.tga\r\ntag_a,\r\n")
    (path / "red.jpg").write_bytes(picture((250, 0, 0), "JPEG"))
    return path


def test_a_model_is_a_scene(folder):
    scene = load_scene(folder / "thing_1.md3")
    assert (scene.num_triangles, [mesh.name for mesh in scene.meshes]) == (2, ["thing_1"])
    assert [material.texture is not None for material in scene.materials] == [True, False]
    assert scene.warnings == ["not drawn as the game does: without its picture, in grey: bare"]
    assert corners(load_md3(folder / "thing_1.md3", frame=1).meshes[0])[0, 0].tolist() == [1, 0, -1.5]


def test_links_do_not_lead_out_of_the_game(folder, tmp_path):
    (tmp_path / "secret.tga").write_bytes(picture((1, 2, 3)))
    (folder / "red.jpg").unlink()
    (folder / "red.tga").symlink_to(tmp_path / "secret.tga")
    with pytest.raises(SceneError, match=r"leads out of the scene's folder .*base; put the file beside the scene$"):
        load_scene(folder / "thing_1.md3")


def patched(data, offset, value):
    return data[:offset] + value.to_bytes(4, "little", signed=True) + data[offset + 4:]


MODEL = md3([triangle()], num_frames=2, tags=[tag(), tag()])
# Where the surface begins: header, two frames, two tags.
AT = 108 + 2 * 56 + 2 * 112


@pytest.mark.parametrize(("data", "message"), [
    (b"", "not a model of Quake III (MD3, version 15)"),
    (md3([], version=14), "not a model of Quake III (MD3, version 15)"),
    (MODEL[:100], "header: 1 of 108 bytes at byte 0, in a file of 100; it is cut short or damaged"),
    (patched(MODEL, 84, 33), "has 33 surfaces; at most 32 are read"),
    (patched(MODEL, 80, -1), "has -1 tags; at most 16 are read"),
    (md3([], num_frames=1), "thing: has nothing to draw"),
    (patched(MODEL, 76, 0), "has no frame 0; there are 0, numbered from 0"),
    (patched(MODEL, 100, -5), "surface 0: 1 of 108 bytes at byte -5, in a file of 704; it is cut short or damaged"),
    (patched(MODEL, 100, 108), "surface 0: is none, or has not the model's 2 frames"),
    (patched(MODEL, AT + 72, 3), "surface 0: is none, or has not the model's 2 frames"),
    (patched(MODEL, AT + 80, 4097), "surface 0: has 4097 vertices and 1 triangles; at most 4096 and 8192 are read"),
    (patched(MODEL, AT + 84, 9000), "surface 0: has 3 vertices and 9000 triangles; at most 4096 and 8192 are read"),
    (patched(MODEL, AT + 80, -3), "surface 0, vertices: -3 of 8 bytes at byte 656, in a file of 704; it is cut short "
     "or damaged"),
    (patched(MODEL, AT + 88, 1 << 30), "surface 0, triangles: 1 of 12 bytes at byte 1073742268, in a file of 704; it "
     "is cut short or damaged"),
    (patched(MODEL, AT + 108, 3), "surface 0: triangle 0 uses vertex 3; there are 3, numbered from 0"),
    (patched(MODEL, AT + 108, -1), "surface 0: triangle 0 uses vertex -1; there are 3, numbered from 0"),
])
def test_bad_models(tmp_path, data, message):
    (tmp_path / "thing.md3").write_bytes(data)
    with pytest.raises(SceneError, match=f"^{re.escape(f'{tmp_path}/thing.md3: {message}')}$"):
        load_scene(tmp_path / "thing.md3")


@pytest.mark.parametrize("frame", [tag((1, np.nan, 1)), tag(axes=np.zeros((3, 3))), tag(axes=np.full((3, 3), np.inf))])
def test_bad_tags(frame):
    model = Md3(md3([], num_frames=2, tags=[tag(), frame]), "m")
    with pytest.raises(SceneError, match=r"^m: tag 'tag_a', frame 1: its axes or its origin are none$"):
        model.tags(1)
    with pytest.raises(SceneError, match=r"^m: has no frame 2; there are 2, numbered from 0$"):
        model.tags(2)


def test_floors():
    ground = np.array([[(0, 0, 0), (4, 0, 4), (0, 4, 0)], [(0, 0, -9), (9, 0, -9), (0, 9, -9)],
                       [(0, 0, 20), (9, 0, 20), (0, 9, 20)]], np.float64)
    points = np.array([(1, 1, 10), (1, 1, 0.5), (4, 4, 0), (20, 0, 7)], np.float64)
    # On the slope z = x; below it; beside it; beside all.
    assert floors(ground, points).tolist() == [1, -9, -9, 7]


def test_real_players(scene_file):
    path = scene_file("openarena/players.pk3")
    scene = quake_players_scene(path.parents[1])
    assert [instance.name for instance in scene.instances[-16:]] == [
        f"{name} {number}" for number in range(4) for name in ("sarge", "merman", "gargoyle", "major")]
    assert [mesh.num_triangles for mesh in scene.meshes[-4:]] == [636, 760, 894, 1128]
    # Feet on the floor, and as tall as people.
    for mesh in scene.meshes[-4:]:
        lower, upper = mesh.bounds()
        assert -26 < lower[2] < -22
        assert 24 < upper[2] < 40
