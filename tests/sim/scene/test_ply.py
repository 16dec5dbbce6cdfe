import gzip
import struct

import numpy as np
import pytest

from sim.scene import SceneError, load_scene

POINTS = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.5), (1.0, 1.0, 0.25), (0.0, 1.0, -2.0), (3.0, 3.0, 3.0)]
HEADER = "ply\nformat {} 1.0\ncomment made by hand\nelement vertex 5\nproperty {} x\nproperty {} y\nproperty {} z\n{}\
element face {}\nproperty list {} {} {}\nend_header\n"


def header(form, *, scalar="float", extra="", num_faces=2, length="uchar", index="int", name="vertex_indices"):
    return HEADER.format(form, scalar, scalar, scalar, extra, num_faces, length, index, name).encode()


def ascii_file(faces, **kwargs):
    body = [" ".join(map(str, point)) for point in POINTS]
    body += [" ".join(map(str, (len(face), *face))) for face in faces]
    return header("ascii", num_faces=len(faces), **kwargs) + "\n".join(body).encode() + b"\n"


def binary_file(faces, order, *, scalar="f", length="B", index="i", **kwargs):
    body = b"".join(struct.pack(f"{order}3{scalar}", *point) for point in POINTS)
    body += b"".join(struct.pack(f"{order}{length}{len(face)}{index}", len(face), *face) for face in faces)
    form = "binary_little_endian" if order == "<" else "binary_big_endian"
    return header(form, num_faces=len(faces), **kwargs) + body


@pytest.fixture
def load(tmp_path):
    def write_and_load(data, name="test.ply"):
        (tmp_path / name).write_bytes(data)
        return load_scene(tmp_path / name)

    return write_and_load


TRIANGLES, MIXED = [(0, 1, 2), (2, 3, 0)], [(0, 1, 2, 3), (4, 3, 2)]
EXPECTED = {"triangles": [[0, 1, 2], [2, 3, 0]], "mixed": [[0, 1, 2], [0, 2, 3], [4, 3, 2]]}
VARIANTS = {
    "ascii": lambda faces: ascii_file(faces),
    "ascii, other names": lambda faces: ascii_file(faces, name="vertex_index", scalar="float64", index="uint32"),
    "little": lambda faces: binary_file(faces, "<"),
    "big": lambda faces: binary_file(faces, ">"),
    "little, double, ushort": lambda faces: binary_file(faces, "<", scalar="d", length="I", index="H") .replace(
        b"property float ", b"property double ").replace(b"list uchar int", b"list uint ushort"),
    "big, int16 lengths": lambda faces: binary_file(faces, ">", length="h").replace(b"list uchar", b"list int16"),
}


@pytest.mark.parametrize(("shape", "faces"), [("triangles", TRIANGLES), ("mixed", MIXED)])
@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("compressed", [False, True])
def test_variants(load, shape, faces, variant, compressed):
    data = VARIANTS[variant](faces)
    scene = load(gzip.compress(data), "test.ply.gz") if compressed else load(data)
    (mesh,) = scene.meshes
    assert mesh.name == "test"
    assert len(scene.instances) == 1
    assert mesh.triangles.tolist() == EXPECTED[shape]
    assert (mesh.vertices == np.array(POINTS)).all()


def test_extra_elements_and_properties_are_passed_over(load):
    text = (b"ply\nformat ascii 1.0\nobj_info x\nelement thing 2\nproperty int a\nproperty int b\nelement vertex 3\n"
            b"property float nx\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
            b"property uchar flag\nproperty list uchar int vertex_indices\nproperty list uchar float w\nend_header\n"
            b"7 7 7 7\n9 0 0 0\n9 1 0 0\n9 0 1 0\n5 3 0 1 2 2 0.5 0.5\n")
    (mesh,) = load(text).meshes
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    assert mesh.triangles.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize(("kind", "full"), [("uchar", 255), ("float", 1.0)])
def test_vertex_colors_become_materials(load, kind, full):
    text = (f"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
            f"property {kind} red\nproperty {kind} green\nproperty {kind} blue\nelement face 2\n"
            f"property list uchar int vertex_indices\nend_header\n"
            f"0 0 0 {full} 0 0\n1 0 0 {full} 0 0\n0 1 0 {full} 0 0\n1 1 0 {full} {full} {full}\n3 0 1 2\n3 1 3 2\n")
    scene = load(text.encode())
    colors = [scene.materials[i].base_color for i in scene.meshes[0].material_ids]
    assert colors[0] == (1, 0, 0)
    assert colors[1] == pytest.approx((1, 1 / 3, 1 / 3), abs=1 / 60)


GOOD = ascii_file(TRIANGLES)


@pytest.mark.parametrize(("data", "message"), [
    (b"plx\n", "not a PLY file: no ply in line 1"),
    (b"ply\nformat ascii 1.0\n", "not a PLY file: no end_header"),
    (GOOD.replace(b"ascii 1.0", b"ascii 2.0"), "test.ply:2: 'format ascii 2.0' is not understood"),
    (GOOD.replace(b"format ascii 1.0\n", b""), "no line 'format ascii|binary"),
    (GOOD.replace(b"float y", b"quad y"), "test.ply:6: 'property quad y' is not understood"),
    (GOOD.replace(b"vertex 5", b"vertex -5"), "test.ply:4: 'element vertex -5' is not understood"),
    (GOOD.replace(b"vertex 5", b"vertex 6000000000000"), "cut short"),
    (GOOD.replace(b"face 2", b"face 3"), "ends within element 'face' of 3; it is cut short"),
    (GOOD.replace(b"3 2 3 0", b"3 2 5 0"), "triangle 1 uses vertex 5; there are 5"),
    (GOOD.replace(b"3 2 3 0", b"3 2 -1 0"), "triangle 1 uses vertex -1"),
    (GOOD.replace(b"3 2 3 0", b"3 2 x 0"), "not a number"),
    (GOOD.replace(b"float z", b"float w"), "lacks x, y or z"),
    (GOOD.replace(b"vertex_indices", b"corners"), "no list 'vertex_indices'"),
    (GOOD.replace(b"element face", b"element edge"), "element 'edge' with a list is not supported"),
    (ascii_file([]), "scene is empty"),
    (b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n", "lacks x, y or z"),
    (GOOD.replace(b"3 2 3 0", b"nan 2 3 0"), "face 1 has a list of length nan"),
    (b"ply\nformat ascii 1.0\nelement point 1\nproperty float x\nend_header\n0\n", "no element 'face'"),
    (binary_file(TRIANGLES, "<")[:-5], "ends within element 'face' of 2; it is cut short"),
    (binary_file(TRIANGLES, "<").replace(b"vertex 5", b"vertex 4000000000"), "cut short"),
    (binary_file(MIXED, ">").replace(b"face 2", b"face 2000000000"), "cut short"),
])
def test_errors(load, data, message):
    with pytest.raises(SceneError, match=message.replace("|", r"\|")):
        load(data)


def test_broken_gzip(load):
    with pytest.raises(SceneError, match="not a whole gzip file"):
        load(gzip.compress(GOOD)[:-9], "test.ply.gz")


def test_what_unpacks_to_much_more_than_its_size(load):
    """Three megabytes of zeros in three kilobytes."""
    data = gzip.compress(GOOD + bytes(3_000_000), 9)
    most = max(50 * len(data), 1 << 16)
    with pytest.raises(SceneError) as error:
        load(data, "test.ply.gz")
    assert str(error.value).endswith(f"test.ply.gz: would unpack to more than {most:,} bytes, 50 times its size; "
                                     "unpack it with gunzip")


@pytest.mark.parametrize(("data", "message"), [
    (binary_file(TRIANGLES, "<").replace(b"float y", b"float x"), "element 'vertex' has 2 properties 'x'"),
    (binary_file(TRIANGLES, "<", length="i").replace(b"list uchar", b"list int32").replace(
        b"\3\0\0\0\0\0\0\0", b"\xfd\xff\xff\xff\0\0\0\0"), "face 0 has a list of length -3"),
    (GOOD.replace(b"end_header", b"element spare 99999999999999999999\nend_header"),
     "ends within element 'spare' of 99999999999999999999; it is cut short"),
])
def test_damaged_headers_and_lengths(load, data, message):
    with pytest.raises(SceneError, match=message):
        load(data)
