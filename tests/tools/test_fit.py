"""``dynrt fit``: what its searches take and leave, and what the command writes and says."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

from boards.packing import Area
from fpu import FloatFormat
from rtl.arithmetic import ARITHMETICS
from rtl.config import ChipConfig
from rtl.program.features import ShaderFeatures
from sim.scene import Light, Material, SceneError, load_scene
from sim.scene.compile import CompiledScene
from tests.sim.golden.rooms import ball, quad, scene_of
from tools import fit_chip
from tools.chip_file import chip_of, chip_text
from tools.cli import main
from tools.errors import BadInput
from tools.fit_chip import Fitting, is_plain
from tools.fit_format import FormatSearch
from tools.fit_pictures import Pictures
from tools.fit_speed import SpeedSearch
from tools.quality import Faults, Quality

DOCS = Path(__file__).parents[2] / "docs"
FINE, CRACKED = (Faults(wrong=0.0, cracks=cracks, phantoms=0, psnr=50.0) for cracks in (0, 1))
#: A box's corner, seen from outside.
CORNER = ("v 0 0 0\nv 3 0 0\nv 0 3 0\nv 0 0 3\nv 0.2 0.3 0.1\nv 1.4 0.3 0.3\nv 0.3 1.3 0.5\n"
          "f 1 2 3\nf 1 3 4\nf 1 4 2\nf 5 6 7\n")


def run(*arguments):
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    return result.exit_code, re.sub(r"\s+", " ", result.output)


@pytest.mark.parametrize(("text", "shown", "admits"), [
    ("wrong=0.5", "wrong ≤ 0.5 %, cracks ≤ 0", (True, False)),
    ("wrong=any, cracks=1", "cracks ≤ 1", (True, True)),
    ("psnr=51,phantoms=3", "wrong ≤ 0.1 %, cracks ≤ 0, phantoms ≤ 3, psnr ≥ 51", (False, False)),
    ("wrong=any,cracks=any", "any", (True, True))])
def test_quality(text, shown, admits):
    quality = Quality.parse(text)
    assert str(quality) == shown
    assert (quality.admits(FINE), quality.admits(CRACKED)) == admits


@pytest.mark.parametrize(("text", "says"), [
    ("good", "'good' is no quality; there are wrong, cracks, phantoms, psnr, as in wrong=0.1,cracks=0"),
    ("cracks=0.5", "'cracks=0.5' is not cracks=WHOLE NUMBER or cracks=any"),
    ("wrong=-1", "'wrong=-1' is not wrong=NUMBER or wrong=any"), ("psnr", "'psnr' is not psnr=NUMBER or psnr=any")])
def test_what_is_no_quality(tmp_path, text, says):
    with pytest.raises(ValueError, match=re.escape(says)):
        Quality.parse(text)
    code, said = run("fit", "room", "--quality", text, "-o", tmp_path / "x.json")
    assert (code, says in said, list(tmp_path.iterdir())) == (2, True, [])


def searched(good, **options):
    """A search in which pictures are fine where ``good(exponent, fraction, variant)``."""
    told = []
    search = FormatSearch(lambda fmt, variant: FINE if good(fmt.exp_width, fmt.frac_width, variant) else CRACKED,
                          Quality(), variants={"separate": {}, "tolerant 1": {}}, tell=told.append, **options)
    return [str(candidate) for candidate in search.run()], search, told


def test_the_narrowest_formats():
    found, search, told = searched(lambda e, f, v: e >= 6 and f >= (14 if v == "separate" else 13))
    assert found == ["6.13 tolerant 1", "6.14 separate"]
    assert "6.13 separate: 0.000 % wrong, 1 cracks, 0 phantoms, 50.0 dB" in told
    assert len(told) == len(search.tried)


def test_no_variant_is_tried_far_beyond_the_narrowest():
    found, _, _ = searched(lambda e, f, v: f >= (17 if v == "separate" else 13))
    assert found == ["5.13 tolerant 1"]


def test_a_format_that_is_good_by_chance_is_not_taken():
    found, _, _ = searched(lambda e, f, v: v == "separate" and f in (11, 15, 16, 17, 18, 19, 20))
    assert found == ["5.15 separate"]


def test_one_exponent_bit_less_is_tried_again():
    # At ample fractions five bits are too few, at the format that is found they do.
    found, _, _ = searched(lambda e, f, v: f >= 15 and (e > 5 or f < 20))
    assert found == ["5.15 separate", "5.15 tolerant 1"]


def test_formats_that_cannot_be_built_are_not_taken():
    assert searched(lambda e, f, v: f >= 17, most_bits=16)[0] == []
    assert searched(lambda e, f, v: f >= 16, most_bits=16)[0] == ["5.16 separate", "5.16 tolerant 1"]


def test_what_does_not_fit_is_not_good():
    search = FormatSearch(lambda fmt, variant: "too narrow", Quality(), tell=lambda text: None)
    assert search.run() == []
    assert search.best() is None


def test_what_comes_nearest():
    _, search, _ = searched(lambda e, f, v: False)
    assert search.best()[2] == CRACKED


def test_less_of_everything_while_it_is_fast_enough():
    def cycles(config):
        return 6400 // config.num_threads * (1 + (config.num_fetches == 1))

    told = []
    search = SpeedSearch(cycles, 4.0, knobs={"num_threads": (8, 16, 32), "num_fetches": (1, 2)}, tell=told.append)
    fitted = search.run(ChipConfig())
    assert (fitted.num_threads, fitted.num_fetches) == (16, 2)
    assert told == ["64 threads, all of it: 100 cycles", "num_threads 8: 800 cycles, 8.00 times, too slow",
                    "num_threads 16: 400 cycles, 4.00 times", "num_fetches 1: 800 cycles, 8.00 times, too slow",
                    "num_fetches 2: 400 cycles, 4.00 times"]


def test_less_is_not_tried_where_there_is_no_more():
    search = SpeedSearch(lambda config: 100, 2.0, knobs={"stack_depth": (8, 16)}, tell=lambda text: None)
    assert search.run(ChipConfig(stack_depth=8)).stack_depth == 8
    assert (search.tried, search.first) == ({}, 100)


def test_a_shallower_tree_must_draw_as_well():
    search = SpeedSearch(lambda config: 100, 2.0, knobs={"stack_depth": (8, 16)}, tell=lambda text: None,
                         is_good=lambda config: config.stack_depth > 8)
    assert search.run(ChipConfig()).stack_depth == 16
    assert search.tried["stack_depth", 8] is None


GREY = Material("grey", (0.5, 0.5, 0.5))
FLOOR = quad([(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)], GREY)
SUN = Light("directional", direction=(0, 0, -1))


def test_plain_scenes():
    assert is_plain(load_scene("room"))
    assert not is_plain(load_scene("mirror-room"))
    assert is_plain(scene_of(FLOOR))
    assert not is_plain(scene_of(FLOOR, lights=[Light("point")]))
    assert not is_plain(scene_of(FLOOR, ambient=(0.1, 0.1, 0.1)))
    assert not is_plain(scene_of(FLOOR, ball((0, 0, 1), 1, GREY, smooth=True)))
    assert not is_plain(scene_of(FLOOR, ball((0, 0, 1), 1, Material("shining", (1, 1, 1), emission=(1, 1, 1)))))


@pytest.mark.parametrize(("material", "depth", "why"), [
    (GREY, 0, "no material mirrors, and none lets light through"),
    (Material("mirror", (1, 1, 1), reflection=1.0), 1, None)])
def test_depth_is_what_shows(material, depth, why):
    scene = scene_of(FLOOR, ball((0, 0, 1), 0.8, material, num_rings=6), lights=[SUN])
    camera = scene.default_camera()
    fitting = Fitting(scene, [(scene, camera)], size=(24, 18), quality=Quality(), depth=3, tell=lambda text: None)
    found = fitting._depth()
    reason, = fitting.reasons
    assert (found, reason.what, reason.value) == (depth, "shader.depth", depth)
    assert reason.why == (why or "0.000 % of golden's pixels differ by more than 8 levels from those of depth 3")


def test_all_numbers_fit_and_none_is_no_triangle():
    image = CompiledScene(load_scene("room"), fmt=FloatFormat(7, 16)).image(load_scene("room"))
    assert image.index_width == max(len(image.lists) - 1, len(image.matrices)).bit_length()
    scene = scene_of(FLOOR)
    with pytest.raises(SceneError) as error:
        CompiledScene(scene, fmt=FloatFormat(7, 16), index_width=1).image(scene)
    assert str(error.value) == ("scene needs 14 kd-tree nodes, more than the 2 that the chip's memory addresses; leave "
                                "objects out or build a chip with a wider index_width")


def test_a_chip_comes_back_from_its_file(tmp_path):
    config = ChipConfig(fmt=FloatFormat(6, 14), num_threads=16, edge_tolerance=2,
                        shader=ShaderFeatures(refraction=False, depth=2))
    path = tmp_path / "chip.json"
    path.write_text(chip_text(config, {"scene": "room"}))
    assert chip_of(path) == config
    assert json.loads(path.read_text())["fmt"] == "6.14"
    path.write_text('{"num_threads": 3}')
    assert chip_of(path) == ChipConfig(num_threads=3)


@pytest.mark.parametrize(("text", "says"), [
    ("{", 'is not JSON (Expecting property name enclosed in double quotes: line 1 column 2 (char 1)); a chip\'s file '
          'is an object such as {"fmt": "7.16", "num_threads": 32}'),
    ("[1]", "the chip is [1]; it must be an object with parameters' names"),
    ('{"threads": 3}', "'threads' is not a parameter of the chip; there are add_latency, arithmetic, cmp_latency, "),
    ('{"fmt": 7.16}', 'fmt is 7.16; it must be a text like "7.16"'),
    ('{"fmt": "7-16"}', "Float format must be written EXPONENT.FRACTION in bits, like 7.16, not '7-16'"),
    ('{"num_threads": "3"}', 'num_threads is "3"; it must be a whole number'),
    ('{"num_threads": true}', "num_threads is true; it must be a whole number"),
    ('{"num_threads": 65}', "num_threads is 65; it must be from 1 to 64"),
    ('{"shader": true}', "the shader is true; it must be an object with parameters' names"),
    ('{"shader": {"about": 1}}', "'about' is not a parameter of the shader; there are depth, "),
    ('{"shader": {"sky": 1}}', "sky is 1; it must be true or false"),
    ('{"shader": {"reflection": false}}', "refraction needs reflection: where it is total, light is mirrored")])
def test_files_that_are_no_chips(tmp_path, text, says):
    path = tmp_path / "chip.json"
    path.write_text(text)
    with pytest.raises(BadInput) as error:
        chip_of(path)
    assert str(error.value).startswith(f"{path}: {says}")
    code, said = run("render", "room", "--chip", path, "-o", tmp_path / "x.png")
    assert (code, says in said, [*tmp_path.iterdir()]) == (2, True, [path])


@pytest.fixture
def corner(tmp_path):
    path = tmp_path / "corner.obj"
    path.write_text(CORNER)
    return path


VIEW = "--camera", "5,4,3,0,0,0,0,0,1,60", "--size", "32x24"


@pytest.mark.chip
@pytest.mark.xdist_group("chip")
def test_a_chip_is_fitted_written_and_draws_as_its_model(tmp_path, corner, monkeypatch):
    monkeypatch.setenv("DYNRT_OPTIMISE", "-O0")
    chip, report = tmp_path / "chip.json", tmp_path / "report.json"
    code, said = run("fit", corner, *VIEW, "--engine", "model", "--no-area", "-o", chip)
    assert code == 0, said
    found = json.loads(chip.read_text())
    config = chip_of(chip)
    assert config.fmt.width < ChipConfig().fmt.width
    assert (config.index_width, config.coord_width, config.shader) == (8, 6, None)
    assert found["about"]["picture"]["cracks"] == 0
    assert found["about"]["picture"]["wrong"] <= 0.1
    reasons = {reason["what"]: reason for reason in found["about"]["because"]}
    assert reasons["shader"]["why"] == ("the scene has neither lights nor ambient light, and its materials are "
                                        "colours alone")
    assert reasons["num_threads"]["why"] == "the default, as no cycles were measured"
    assert reasons["stack_depth"]["why"] == (
        f"the deepest of the scene's kd-trees has {config.stack_depth} levels below its root, and no ray puts off more "
        "nodes than that, wherever it goes")
    assert f"{chip}: draw with it by dynrt render {corner} --chip {chip}" in said
    # One bit less does not do, in no way to compute.
    narrower = FloatFormat(config.fmt.exp_width, config.fmt.frac_width - 1)
    tried = [Faults(**faults) for name, faults in found["about"]["formats"].items() if name.startswith(f"{narrower},")]
    assert tried
    assert not any(map(Quality().admits, tried))

    code, said = run("render", corner, *VIEW, "--chip", chip, "--chip", "num_threads=2", "-o", tmp_path / "x.png",
                     "--report", report)
    assert code == 0, said
    described = json.loads(report.read_text())
    assert described["wrong_pixels_vs_model"] == 0
    assert described["wrong_pixels_vs_golden"] <= 0.001 * 32 * 24
    assert (described["format"], described["config"]["num_threads"]) == (str(config.fmt), 2)


def test_full_shading_has_the_switches_of_the_scene():
    scene = scene_of(FLOOR, ball((0, 0, 1), 0.8, Material("mirror", (1, 1, 1), reflection=0.5), num_rings=6),
                     lights=[SUN])
    fitting = Fitting(scene, [(scene, scene.default_camera())], size=(16, 12), quality=Quality(wrong=2.0), depth=3,
                      tell=lambda text: None)
    fitting.fit(has_clock=False, has_area=False)
    shader, needs = fitting.config.shader, CompiledScene(scene, fmt=FloatFormat(7, 16)).needs
    assert (shader.missing(needs), needs.missing(shader)) == ([], [])
    reasons = {reason.what: reason.value for reason in fitting.reasons}
    assert reasons["shader"] == "reflection, directional_lights, shadows"
    assert reasons["lights"] == 1
    assert fitting.config.fmt.frac_width <= 16


@pytest.fixture
def shading_chip(tmp_path):
    scene = load_scene("mirror-room")
    config = ChipConfig(shader=replace(CompiledScene(scene, fmt=FloatFormat(7, 16)).needs, depth=2))
    path = tmp_path / "chip.json"
    path.write_text(chip_text(config))
    return path


def test_a_chip_with_a_shader_draws_full_shading(tmp_path, shading_chip):
    report = tmp_path / "report.json"
    common = "render", "mirror-room", "--size", "8x6", "--chip", shading_chip, "-o", tmp_path / "x.png"
    code, said = run(*common, "--engine", "model", "--report", report)
    assert code == 0, said
    assert json.loads(report.read_text())["config"]["shader"]["depth"] == 2
    for arguments, says in (
            (["--shading", "simple"], "--shading: the chip of --chip has a shader, which draws full shading; leave "
             '--shading out, or write "shader": null in the file'),
            (["--depth", "9"], "--depth: the chip of --chip is built for 2 generations; leave --depth out")):
        code, said = run(*common, *arguments)
        assert code == 2
        assert says in said


def test_a_shader_that_lacks_something(tmp_path, shading_chip):
    shading_chip.write_text(shading_chip.read_text().replace('"spot_lights": true', '"spot_lights": false').replace(
        '"smooth": true', '"smooth": false'))
    before = sorted(tmp_path.iterdir())
    code, said = run("render", "mirror-room", "--size", "8x6", "--chip", shading_chip, "-o", tmp_path / "x.png")
    assert code == 2
    assert re.search("Error: --chip: the chip's shader lacks what the scene needs: .*smooth; fit a chip to the scene "
                     "with dynrt fit", said)
    assert sorted(tmp_path.iterdir()) == before


def test_what_no_chip_draws(tmp_path, corner):
    before = sorted(tmp_path.iterdir())
    code, said = run("fit", corner, *VIEW, "--engine", "model", "--no-area", "--quality", "psnr=99", "-o",
                     tmp_path / "chip.json")
    assert code == 2
    assert re.search(r"Error: no format of up to 23 fraction bits draws this well enough \(wrong ≤ 0.1 %, cracks ≤ 0, "
                     r"psnr ≥ 99\); what comes nearest is \d\.\d+, [\w -]+: .* dB; ask for less with --quality", said)
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(("arguments", "says"), [
    (["room", "-o", "x.png"], "-o: x.png must end in .json"),
    (["room", "-o", "no/such/x.json"], "no/such/x.json: there is no folder no/such"),
    (["room", "--place", "--no-area"], "--place: what is placed has an area; leave --no-area out"),
    (["room", "--view", "7"], "--view: there is no camera 7, the scene has cameras 0 to 0"),
    (["none.obj"], "none.obj: No such file or directory"),
    (["room", "-o", "x.json", "--docs", "."], "-o: with --docs the file has its place; leave one of them out"),
    (["room", "--slower", "0.5"], "0.5 is not in the range x>=1")])
def test_bad_options(tmp_path, monkeypatch, arguments, says):
    monkeypatch.chdir(tmp_path)
    code, said = run("fit", *arguments)
    assert code == 2
    assert says in said
    assert list(tmp_path.iterdir()) == []


def test_two_chips(tmp_path):
    paths = [tmp_path / name for name in ("a.json", "b.json")]
    for path in paths:
        path.write_text("{}")
    code, said = run("render", "room", "--chip", paths[0], "--chip", paths[1], "-o", tmp_path / "x.png")
    assert (code, f"--chip: {paths[0]} and {paths[1]} are two chips; name one file" in said) == (2, True)


def test_area_decides_between_ways(monkeypatch):
    scene = scene_of(FLOOR)
    sizes = {"table": 900, "reciprocal": 800, "fused-narrow": 700, "truncated": 950}
    monkeypatch.setattr(fit_chip, "datapath_tables", lambda way, progress: sizes[ARITHMETICS[way.arithmetic].name])
    whole = {"fused-narrow": 5000, "reciprocal": 4000}
    taken = []

    def area_of(chip, *, name, progress):
        taken.append(name)
        return Area(lut=whole.get(ARITHMETICS[chip.arithmetic].name, 9000), ff=10, dsp=5, ebr=20)

    monkeypatch.setattr(fit_chip, "area_of", area_of)
    fitting = Fitting(scene, [(scene, scene.default_camera())], size=(8, 6), quality=Quality(),
                      tell=lambda text: None)
    fitting.fit(has_clock=False, has_area=True)
    assert ARITHMETICS[fitting.config.arithmetic].name == "reciprocal"
    assert fitting.figures["tables"] == [4000, 9000]
    assert taken[-1] == "the full chip"
    reasons = {reason.what: reason for reason in fitting.reasons}
    assert reasons["device"].value == "LFE5U-25F"
    assert reasons["memory"].value == "on the chip"


def test_pictures_say_what_does_not_fit():
    scene = scene_of(FLOOR)
    pictures = Pictures(scene, [(scene, scene.default_camera())], (8, 6), shading="simple")
    assert isinstance(pictures.faults(ChipConfig(fmt=FloatFormat(2, 4))), str | Faults)
    assert pictures.faults(ChipConfig()).cracks == 0


@pytest.fixture
def docs(tmp_path):
    folder = tmp_path / "docs"
    (folder / "results").mkdir(parents=True)
    shutil.copy(DOCS / "accuracy.md", folder)
    return folder


def test_a_row_of_the_page(docs, corner):
    code, said = run("fit", corner, *VIEW, "--engine", "model", "--no-area", "--docs", docs, "--shading", "simple")
    assert code == 0, said
    path = docs / "results" / "fit-corner-simple.json"
    config, about = chip_of(path), json.loads(path.read_text())["about"]
    row = next(line for line in (docs / "accuracy.md").read_text().splitlines() if line.startswith("| corner |"))
    way = f"{ARITHMETICS[config.arithmetic].name}, {config.edge_tolerance}"
    assert row == (f"| corner | 32×24 | {config.fmt} | {way} | none | 64 | {config.stack_depth} | "
                   f"{about['picture']['wrong']:.3f} % wrong, 0 cracks | – | – | – | – | – | "
                   f"{about['image_bytes'] / 1024:.0f} | – | – | – |")


@pytest.mark.parametrize(("spoil", "says"), [
    (lambda docs: (docs / "accuracy.md").write_text("nothing"), "accuracy.md: must have the lines '<!-- begin: fit "
     "-->' and '<!-- end: fit -->' once, for the table between them"),
    (lambda docs: (docs / "results" / "fit-x.json").write_text("{}"), "fit-x.json: is not what dynrt fit writes; fit "
     "that scene anew, or remove it")])
def test_pages_that_cannot_be_filled(docs, corner, spoil, says):
    spoil(docs)
    before = {path: path.read_bytes() for path in docs.rglob("*") if path.is_file()}
    code, said = run("fit", corner, *VIEW, "--engine", "model", "--no-area", "--docs", docs)
    assert code == 2
    assert says in said
    assert {path: path.read_bytes() for path in docs.rglob("*") if path.is_file()} == before


def test_committed_chips_are_what_they_say():
    for path in (DOCS / "results").glob("fit-*.json"):
        config, about = chip_of(path), json.loads(path.read_text())["about"]
        assert Quality().admits(Faults(**about["picture"]))
        assert about["figures"]["tables"]["chip"] < about["figures"]["tables"]["full"]
        assert (config.shader is None) == (about["shading"] == "simple")
    room = json.loads((DOCS / "results" / "fit-room.json").read_text())["about"]["figures"]["tables"]
    assert room["chip"] <= room["full"] / 2
