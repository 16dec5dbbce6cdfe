"""Options as people type them."""

import re
from dataclasses import fields, replace
from pathlib import Path

import click

from fpu import FloatFormat
from rtl.config import ChipConfig
from sim.scene import Camera, SceneError

from .chip_file import chip_of
from .errors import BadInput
from .quality import Quality

__all__ = ["CAMERA", "CHIP", "CYCLES", "FORMAT", "PIXEL", "QUALITY", "SIZE", "camera_of", "chip_config", "docs_option",
           "scenes_option"]


class _Parsed(click.ParamType):
    def __init__(self, name, parse):
        self.name = name
        self._parse = parse

    def convert(self, value, param, ctx):
        if not isinstance(value, str):
            return value
        try:
            return self._parse(value)
        except (ValueError, SceneError) as error:
            self.fail(str(error), param, ctx)


def _size(text):
    match = re.fullmatch(r"(\d+)x(\d+)", text)
    if not match or not all(1 <= int(number) <= 4095 for number in match.groups()):
        raise ValueError(f"'{text}' is not WIDTHxHEIGHT with both from 1 to 4095, like 512x384")
    return tuple(map(int, match.groups()))


def _pixel(text):
    match = re.fullmatch(r"(\d+),(\d+)", text)
    if not match:
        raise ValueError(f"'{text}' is not X,Y like 256,192")
    return tuple(map(int, match.groups()))


def _cycles(text):
    match = re.fullmatch(r"(\d+):(\d+)", text)
    if not match or int(match[1]) >= int(match[2]):
        raise ValueError(f"'{text}' is not FIRST:LAST with FIRST before LAST, like 1000:2000")
    return tuple(map(int, match.groups()))


_PARAMETERS = {field.name for field in fields(ChipConfig)} - {"fmt", "shader"}


def _chip(text):
    if text.endswith(".json"):
        return Path(text)
    name, _, value = text.partition("=")
    if name not in _PARAMETERS:
        raise ValueError(f"'{name}' is not a parameter of the chip; there are {', '.join(sorted(_PARAMETERS))}")
    if not re.fullmatch(r"-?\d+", value):
        raise ValueError(f"'{text}' is not NAME=NUMBER like num_threads=32")
    return name, int(value)


SIZE = _Parsed("WIDTHxHEIGHT", _size)
PIXEL = _Parsed("X,Y", _pixel)
CYCLES = _Parsed("FIRST:LAST", _cycles)
CAMERA = _Parsed("NUMBERS", Camera.parse)
FORMAT = _Parsed("E.F", FloatFormat.parse)
QUALITY = _Parsed("NAME=BOUND,...", Quality.parse)
CHIP = _Parsed("NAME=NUMBER|FILE.json", _chip)


_FOLDER = click.Path(exists=True, file_okay=False, path_type=Path)
#: Of commands that measure on files of scenes.
scenes_option = click.option("--scenes", type=_FOLDER, required=True, help="Folder with the scenes and cameras.json")


def docs_option(what):
    """The option of commands that write to docs/; ``what`` they find and write there."""
    return click.option("--docs", type=_FOLDER, default=Path("docs"), show_default=True, help=what)


def chip_config(fmt, parameters):
    """The chip that is asked for.

    Parameters
    ----------
    fmt : FloatFormat or None
        Of the chip, over that of its file; default 7.16.
    parameters : list
        Parameters (name, value) over those of a chip's file, whose Path may be among them.

    Raises
    ------
    BadInput, UsageError
        If the file cannot be used, there are two, or a parameter is out of its range.
    """
    files = [given for given in parameters if isinstance(given, Path)]
    if len(files) > 1:
        raise click.UsageError(f"--chip: {files[0]} and {files[1]} are two chips; name one file")
    changed = {**({"fmt": fmt} if fmt else {}), **dict(given for given in parameters if given not in files)}
    config = chip_of(files[0]) if files else None
    try:
        return ChipConfig(**changed) if config is None else replace(config, **changed)
    except ValueError as error:
        raise click.UsageError(f"--chip: {error}") from error


def camera_of(scene, camera, view):
    """The Camera that ``--camera`` and ``--view`` ask for.

    Raises
    ------
    BadInput
        If the scene has no such view.
    """
    if camera is not None:
        return camera
    if view is None:
        return scene.default_camera()
    if view >= len(scene.cameras):
        have = f"cameras 0 to {len(scene.cameras) - 1}" if scene.cameras else "no cameras; use --camera"
        raise BadInput(f"--view: there is no camera {view}, the scene has {have}")
    return scene.cameras[view]
