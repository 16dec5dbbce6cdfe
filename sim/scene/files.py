"""Which other files a scene file may open."""

from pathlib import Path

from .error import SceneError

__all__ = ["inside"]


def inside(folder, name):
    """Path of ``name`` in ``folder``, links resolved.

    Raises
    ------
    SceneError
        If that leads out of the folder: a scene from elsewhere must not read the user's other files.
    """
    folder = Path(folder).resolve()
    try:
        path = (folder / name.replace("\\", "/")).resolve()
    except (ValueError, OSError, RuntimeError) as error:
        raise SceneError(f"'{name}': {error}") from None
    if not path.is_relative_to(folder) or "\0" in name:
        raise SceneError(f"'{name}' leads out of the scene's folder {folder}; put the file beside the scene")
    return path
