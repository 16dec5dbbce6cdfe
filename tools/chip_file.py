"""A chip's parameters in a file: JSON, an object with the names of :class:`~rtl.config.ChipConfig`."""

import json
from dataclasses import asdict, fields

from fpu import FloatFormat
from rtl.config import ChipConfig
from rtl.program.features import ShaderFeatures

from .errors import BadInput

__all__ = ["chip_of", "chip_text"]

#: What a file says besides: where it comes from. It is not read.
ABOUT = "about"


def chip_text(config, about=None):
    """What a chip's file holds.

    Parameters
    ----------
    config : ChipConfig
    about : dict, optional
        Where it comes from, for people.
    """
    parameters = asdict(config) | {"fmt": str(config.fmt),
                                   "shader": None if config.shader is None else asdict(config.shader)}
    return json.dumps(({ABOUT: about} if about else {}) | parameters, indent=1, ensure_ascii=False) + "\n"


def chip_of(path):
    """The ChipConfig in a file; what the file does not name has its default.

    ``fmt`` is written as ``"7.16"``, ``shader`` is null or an object with the names of
    :class:`~rtl.program.features.ShaderFeatures`, all else is numbers.

    Raises
    ------
    BadInput
        If it cannot be read or is not that; the message names the file and the parameter.
    """
    try:
        values = json.loads(path.read_text())
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"{path}: cannot be read: {getattr(error, 'strerror', None) or 'it is no text'}") from error
    except ValueError as error:
        raise BadInput(f"{path}: is not JSON ({error}); a chip's file is an object such as "
                       '{"fmt": "7.16", "num_threads": 32}') from error
    parameters = dict(_known(path, values, ChipConfig, "the chip"))
    try:
        if "fmt" in parameters:
            if not isinstance(parameters["fmt"], str):
                raise BadInput(f"{path}: fmt is {json.dumps(parameters['fmt'])}; it must be a text like \"7.16\"")
            parameters["fmt"] = FloatFormat.parse(parameters["fmt"])
        if parameters.get("shader") is not None:
            parameters["shader"] = ShaderFeatures(**dict(_known(path, parameters["shader"], ShaderFeatures,
                                                                "the shader")))
        return ChipConfig(**parameters)
    except ValueError as error:
        raise BadInput(f"{path}: {error}") from error


def _known(path, values, kind, whose):
    """Pairs of names and values, each a parameter of ``kind`` and of its type."""
    if not isinstance(values, dict):
        raise BadInput(f"{path}: {whose} is {json.dumps(values)}; it must be an object with parameters' names")
    types = {field.name: field.type for field in fields(kind)}
    for name, value in values.items():
        if name == ABOUT and kind is ChipConfig:
            continue
        if name not in types:
            raise BadInput(f"{path}: '{name}' is not a parameter of {whose}; there are {', '.join(sorted(types))}")
        expected = types[name]
        if expected in (int, bool, int | None) and type(value) is not (bool if expected is bool else int):
            what = "true or false" if expected is bool else "a whole number"
            raise BadInput(f"{path}: {name} is {json.dumps(value)}; it must be {what}")
        yield name, value
