"""``dynrt render``: one picture or an animation, by whichever engine."""

import contextlib
import json
from dataclasses import asdict, replace
from pathlib import Path

import click
import numpy as np
from rich.console import Console

from rtl.memory_system import FRAME_STRIDE
from sim.golden import MAX_DEPTH, SHADINGS, psnr, render_golden
from sim.scene import Sky, load_scene
from sim.scene.compile import CompiledScene
from sim.scene.limits import limit_warnings
from sim.scene.texture import decode_texture

from .animation import frame_durations, save_animation, save_picture
from .engines import ENGINES, MEMORIES, Order, draw, model_picture, progress_on
from .errors import BadInput, check_folders, clear_errors, written_whole
from .options import CAMERA, CHIP, CYCLES, FORMAT, PIXEL, SIZE, camera_of, chip_config

__all__ = ["render"]

# Pixels up to which the model and golden pictures are drawn without being asked for, to compare with.
_CHECKED_PIXELS = 1 << 21


@click.command()
@click.argument("scene")
@click.option("-o", "--output", type=click.Path(dir_okay=False, path_type=Path), help="PNG to write, or "
              "GIF of --frames  [default: the scene's name + .png]")
@click.option("--engine", type=click.Choice(ENGINES), default="rtl", show_default=True,
              help="golden: float64 ray tracer; model: the chip without a clock; rtl: the Verilated chip; pysim: the "
              "chip in Amaranth's simulator")
@click.option("--size", type=SIZE, default="512x384", show_default=True)
@click.option("--format", "fmt", type=FORMAT, help="The chip's floats: exponent and fraction bits  [default: the chip "
              "file's, else 7.16]")
@click.option("--camera", type=CAMERA, help="eye x,y,z, look-at x,y,z, up x,y,z, horizontal field of view in degrees")
@click.option("--view", type=click.IntRange(min=0), help="Number of a camera in the scene's file  [default: the first]")
@click.option("--frames", type=click.IntRange(min=1), help="Draw so many pictures of an animated scene: "
              "NAME-0000.png and so on, and an animation, NAME.png or NAME.gif; a report has a list")
@click.option("--shading", type=click.Choice(SHADINGS), help="simple: colour times cosine; full: lights, shadows, "
              "textures, reflection, refraction  [default: full by a chip file with a shader, else simple]")
@click.option("--depth", type=click.IntRange(0, MAX_DEPTH), help="Generations of secondary rays of full shading  "
              "[default: the chip file's, else 4]")
@click.option("--sky", type=click.Path(dir_okay=False, path_type=Path), help="Panorama (equirectangular picture) "
              "round the scene, for full shading  [default: the scene's own, else the background]")
@click.option("--background", type=click.IntRange(0, 255), nargs=3, default=(0, 0, 0), show_default=True,
              metavar="R G B")
@click.option("--flatten/--instances", default=None, help="Put all triangles into one space, or transform rays into "
              "each instance  [default: flatten if nothing moves and no mesh is there twice]")
@click.option("--center", type=click.Choice(["eye", "scene"]), default="eye", show_default=True,
              help="Where the chip's numbers are finest, of a scene of instances")
@click.option("--chip", "parameters", type=CHIP, multiple=True, help="A parameter of the chip, see "
              "rtl/config.py, or a file with them, such as dynrt fit writes")
@click.option("--memory", type=click.Choice(MEMORIES), default="latency", show_default=True, help="What the simulated "
              "chip reads from: memories that answer after --latency cycles, or an SDRAM at 125 MHz")
@click.option("--latency", type=click.IntRange(1, 1000), default=4, show_default=True,
              help="Cycles from a memory request to its first word")
@click.option("--jitter", type=click.IntRange(0, 1000), default=0, show_default=True,
              help="Up to so many cycles more, at random")
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True, help="Of that randomness")
@click.option("--wave", type=click.Path(dir_okay=False, path_type=Path), help="Waveform to write, .vcd or .fst")
@click.option("--wave-cycles", type=CYCLES, help="Only these cycles  [default: all]")
@click.option("--wave-pixel", "wave_pixels", type=PIXEL, multiple=True, help="Only while this pixel is at work")
@click.option("--hits", type=click.Path(dir_okay=False, path_type=Path), help="NPZ to write, with instance_id, "
              "prim_id, t, u, v of each pixel")
@click.option("--report", type=click.Path(dir_okay=False, path_type=Path), help="JSON to write")
@click.option("--check/--no-check", default=True, help="Compare with the model and with golden")
def render(scene, output, engine, size, fmt, camera, view, frames, shading, depth, sky, background, flatten,
           center, parameters, memory, latency, jitter, seed, wave, wave_cycles, wave_pixels, hits, report, check):
    """Draw SCENE: an .obj, .ply, .ply.gz, .gltf, .glb or .md3 file, a map in a .pk3 (FILE.pk3, or FILE.pk3:MAP where it
    has several), or a built-in one: room, mirror-room, vpl, walk or sunflowers."""
    config = chip_config(fmt, parameters)
    shading = shading or ("simple" if config.shader is None else "full")
    _check_shading(engine, shading, depth, sky, hits, config)
    if depth is None:
        depth = 4 if config.shader is None else config.shader.depth
    order = Order(engine=engine, size=size, config=config, shading=shading, depth=depth, background=background,
                  memory=memory, latency=latency, jitter=jitter, seed=seed, wave=wave, wave_cycles=wave_cycles,
                  wave_pixels=wave_pixels)
    output = output or Path(f"{Path(scene).name.split('.')[0]}.png")
    _check_options(order, output, frames, hits)
    check_folders(output, wave, hits, report)
    console = Console(stderr=True, highlight=False)
    with clear_errors(), contextlib.ExitStack() as files:
        loaded = load_scene(scene)
        chosen = camera_of(loaded, camera, view)
        if sky is not None:
            loaded = replace(loaded, sky=_panorama(sky, chosen))
        if frames and not loaded.is_animated:
            raise BadInput(f"{scene}: nothing moves in this scene; leave --frames out")
        times = [0.0] if not frames else [loaded.duration * k / frames for k in range(frames)]
        durations = frame_durations(frames, loaded.duration, is_gif=_is_gif(output)) if frames else []
        compiled = None
        if engine != "golden":
            with progress_on(console, "building kd-trees"):
                compiled = CompiledScene(loaded, fmt=config.fmt, stack_depth=order.config.stack_depth,
                                         index_width=order.config.index_width, flatten=flatten,
                                         from_eye=center == "eye")
        for warning in [*loaded.warnings, *(_chip_warnings(compiled, order, center) if compiled else [])]:
            console.print(f"warning: {warning}", markup=False)
        if wave:
            order = replace(order, wave=files.enter_context(written_whole(wave)))

        poses = [(posed, chosen if camera is not None else camera_of(posed, None, view))
                 for posed in map(loaded.at_time, times)]
        chip = order.config if compiled is None else order.chip_for(compiled)
        drawn = []
        for number, (frame, image) in enumerate(draw(order, compiled, poses, is_moving=bool(frames), console=console)):
            _describe(frame, order, scene, chip)
            if frames:
                frame.report["time"] = times[number]
            if check:
                _compare(frame, order, *poses[number], image, chip)
            name = output if not frames else output.with_name(f"{output.stem}-{number:04d}.png")
            drawn.append((name, frame))
            _print_summary(console, name, frame)
        # All is drawn; from here on files appear, and only if all of them can be written.
        for name, frame in drawn:
            save_picture(files.enter_context(written_whole(name)), frame.color)
        if frames:
            save_animation(files.enter_context(written_whole(output)), [frame.color for _, frame in drawn], durations)
        if hits:
            frame = drawn[0][1]
            with open(files.enter_context(written_whole(hits)), "wb") as file:
                np.savez_compressed(file, instance_id=frame.instance_id, prim_id=frame.prim_id, t=frame.t, u=frame.u,
                                    v=frame.v)
        if report:
            reports = [frame.report for _, frame in drawn]
            files.enter_context(written_whole(report)).write_text(
                json.dumps(reports if frames else reports[0], indent=1) + "\n")


def _chip_warnings(compiled, order, center):
    return [*compiled.warnings, *limit_warnings(compiled.scene, fmt=order.config.fmt, is_flat=compiled.is_flat,
                                                from_eye=center == "eye")]


def _is_gif(path):
    return path.suffix.lower() == ".gif"


def _check_shading(engine, shading, depth, sky, hits, config):
    if shading == "simple" and config.shader is not None and engine != "golden":
        raise click.UsageError("--shading: the chip of --chip has a shader, which draws full shading; leave --shading "
                               "out, or write \"shader\": null in the file")
    if config.shader is not None and depth not in (None, config.shader.depth):
        raise click.UsageError(f"--depth: the chip of --chip is built for {config.shader.depth} generations; leave "
                               "--depth out")
    if depth is not None and shading != "full":
        raise click.UsageError("--depth is of full shading; use --shading full")
    if hits is not None and shading == "full" and engine in ("rtl", "pysim"):
        raise click.UsageError("--hits: a chip with full shading keeps no hits; use --engine model, or --shading "
                               f"simple with --engine {engine}")
    if sky is not None and shading != "full":
        raise click.UsageError("--sky is of full shading; use --shading full")


def _check_options(order, output, frames, hits):
    (width, height), config, engine, wave = order.size, order.config, order.engine, order.wave
    if max(order.size) >= 1 << config.coord_width:
        raise click.UsageError(f"--size: {width}x{height} is too large for a chip with coord_width = "
                               f"{config.coord_width}, which draws up to {(1 << config.coord_width) - 1} pixels a side")
    if _is_gif(output) and not frames:
        raise click.UsageError(f"-o: {output.name} would be an animation; give --frames, or a name that ends in .png")
    if not _is_gif(output) and output.suffix.lower() != ".png":
        raise click.UsageError(f"-o: {output.name} must end in .png{', or .gif' if frames else ''}")
    if order.memory == "sdram":
        if engine != "rtl":
            raise click.UsageError(f"--memory sdram works with --engine rtl only, not {engine}")
        if frames or wave is not None or order.jitter:
            raise click.UsageError("--memory sdram: leave --frames, --wave and --jitter out")
        if max(order.size) > FRAME_STRIDE:
            raise click.UsageError(f"--size: {width}x{height} is too large for --memory sdram, which keeps pictures of "
                                   f"up to {FRAME_STRIDE} pixels a side")
    if wave is None and (order.wave_cycles or order.wave_pixels):
        raise click.UsageError("--wave-cycles and --wave-pixel need --wave FILE")
    if wave is not None:
        if engine not in ("rtl", "pysim"):
            raise click.UsageError(f"--wave: the engine {engine} has no clock; use --engine rtl or pysim")
        kinds = (".vcd", ".fst") if engine == "rtl" else (".vcd",)
        if wave.suffix.lower() not in kinds:
            raise click.UsageError(f"--wave: {wave.name} must end in {' or '.join(kinds)} with --engine {engine}")
        if engine == "pysim" and (order.wave_cycles or order.wave_pixels):
            raise click.UsageError("--wave-cycles and --wave-pixel work with --engine rtl only")
        if frames:
            raise click.UsageError("--wave shows one picture; leave --frames out")
    for x, y in order.wave_pixels:
        if x >= width or y >= height:
            raise click.UsageError(f"--wave-pixel: {x},{y} is outside of the picture of {width}x{height}")
    if hits is not None and frames and frames > 1:
        raise click.UsageError("--hits is of one picture; leave --frames out")


def _panorama(path, camera):
    """The sky in a file, its upper edge at the world's axis nearest to the camera's up."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise BadInput(f"--sky: {path}: {error.strerror}") from error
    up = np.eye(3)[np.abs(camera.up).argmax()] * np.sign(camera.up[np.abs(camera.up).argmax()])
    return Sky.from_panorama(decode_texture(data, str(path), []).pixels, up=up)


def _describe(frame, order, scene, config):
    parameters = asdict(config)
    del parameters["fmt"]
    frame.report.update(engine=order.engine, scene=str(scene), size=list(order.size), format=str(config.fmt),
                        config=parameters)


def _compare(frame, order, scene, camera, image, config):
    if order.size[0] * order.size[1] > _CHECKED_PIXELS:
        return
    has_clock = order.engine in ("rtl", "pysim")
    if has_clock:
        model = model_picture(order, image, camera, config)
        differs = (frame.color != model.color).any(axis=-1) if order.is_full else frame.differs(model)
        frame.report["wrong_pixels_vs_model"] = int(differs.sum())
        frame.report.update({name: model.report[name] for name in ("counts", "ray_kinds") if name in model.report})
    if order.engine != "golden":
        golden = render_golden(scene, camera, *order.size, background=order.background, shading=order.shading,
                               depth=order.depth)
        # A chip with full shading keeps no hits; its model does.
        surface = model if order.is_full and has_clock else frame
        frame.report["wrong_pixels_vs_golden"] = int(surface.differs_in_surface(golden).sum())
        frame.report["psnr_vs_golden"] = psnr(frame.color, golden.color)


def _print_summary(console, name, frame):
    report = frame.report
    pixels = report["size"][0] * report["size"][1]
    parts = [f"{name}: {report['engine']}, {report['seconds']:.1f} s"]
    if "cycles" in report:
        parts.append(f"{report['cycles']:,} cycles, {report['cycles_per_ray']:.2f} a ray, "
                     f"{report['simulated_hz'] / 1e3:.0f} kHz")
    if "upload" in report:
        upload = report["upload"]
        rate = f", {upload['bytes_per_cycle']:.2g} a cycle of the last frame" if "bytes_per_cycle" in upload else ""
        parts.append(f"{upload['bytes']:,} bytes uploaded{rate}")
    if "sdram" in report:
        sdram = report["sdram"]
        parts.append(f"SDRAM: {sdram['bytes']:,} bytes, data lines busy {100 * sdram['busy']:.1f} % of the time")
    if "wrong_pixels_vs_model" in report:
        parts.append(f"{report['wrong_pixels_vs_model']} pixels differ from the model")
    if "wrong_pixels_vs_golden" in report:
        share = 100 * report["wrong_pixels_vs_golden"] / pixels
        parts.append(f"{report['wrong_pixels_vs_golden']} show another triangle than golden ({share:.3f} %), "
                     f"PSNR {report['psnr_vs_golden']:.1f} dB")
    console.print("\n  ".join(parts), markup=False)
