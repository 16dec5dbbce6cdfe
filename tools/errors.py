"""How commands end when something is wrong, and how they write files whole or not at all."""

import os
import tempfile
from contextlib import contextmanager
from pathlib import Path

import click

from boards.toolchain import ToolError
from sim.machine import BuildError, SimulationError
from sim.scene import SceneError

__all__ = ["BadInput", "Failure", "check_folders", "clear_errors", "written_whole"]


class BadInput(click.ClickException):
    """Something given by the user cannot be used."""

    exit_code = 2


class Failure(click.ClickException):
    """The input was good, and still it did not work."""

    exit_code = 1


@contextmanager
def clear_errors():
    """Turns the errors of the packages into messages and exit codes."""
    try:
        yield
    except (SceneError, OverflowError) as error:
        raise BadInput(str(error)) from error
    except (BuildError, SimulationError, ToolError) as error:
        raise Failure(str(error)) from error


def check_folders(*paths):
    """Sees, before the long work, that what is to be written has folders to be in; None is nothing.

    Raises
    ------
    BadInput
        If one has not.
    """
    for path in paths:
        if path is not None and not path.parent.is_dir():
            raise BadInput(f"{path}: there is no folder {path.parent}")


@contextmanager
def written_whole(path):
    """A path to write to, which becomes ``path`` only if all goes well."""
    path = Path(path)
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.stem}-", suffix=path.suffix)
    except OSError as error:
        raise BadInput(f"{path}: cannot be written: {error.strerror}") from error
    os.close(handle)
    try:
        yield Path(name)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(name, 0o666 & ~umask)
        os.replace(name, path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
