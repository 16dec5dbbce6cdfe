"""The one exception of everything that reads or builds a scene."""

__all__ = ["SceneError"]


class SceneError(Exception):
    """A scene that cannot be used; the message names the file, line or element, and what would be right."""
