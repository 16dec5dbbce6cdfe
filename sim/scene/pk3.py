"""Game archives (.pk3), zip files read with bounds on what they may unpack to; and folders, as unpacked ones."""

import zipfile
from pathlib import PurePosixPath

from .error import SceneError
from .files import inside

__all__ = ["MAX_TEXT", "Archive", "Folder", "read_text"]

# The largest of the game's own files is a tenth of this; a few bytes must not take the machine's memory.
_MAX_FILE = 1 << 26
_MAX_TOTAL = 1 << 29
#: Bytes of a text, such as a script.
MAX_TEXT = 1 << 20
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_ENCRYPTED = 1


def _key(name):
    """As the game compares names: without case, with either slash."""
    return name.replace("\\", "/").lower().lstrip("/")


class Archive:
    """The files in a .pk3, by names without case; the directory is read at once, each file when it is asked for.

    Parameters
    ----------
    path : path-like

    Raises
    ------
    SceneError
        If it is no zip file. (OSError if it cannot be opened.)
    """

    def __init__(self, path):
        self.path = path
        self._left = _MAX_TOTAL
        try:
            # Kept open, as its directory may be long; it closes itself.
            self._zip = zipfile.ZipFile(path)
            members = self._zip.infolist()
        except OSError:
            raise
        # Of damaged directories zipfile raises what it stumbles over.
        except Exception as error:
            raise SceneError(f"{path}: not a .pk3 (zip) file: {error}") from None
        # Of files of one name the last counts, as in zipfile.
        self._members = {_key(member.filename): member for member in members if not member.is_dir()}

    def __contains__(self, name):
        return _key(name) in self._members

    def names(self, folder, suffix):
        """Names, in order, of the files right in a folder whose names end in ``suffix``; both in lower case."""
        return sorted(name for name in self._members
                      if name.endswith(suffix) and str(PurePosixPath(name).parent) == folder)

    def read(self, name):
        """Bytes of a file.

        Raises
        ------
        SceneError
            If it is not there, damaged, packed in a way that the game does not know, or too large.
        """
        member = self._members.get(_key(name))
        if member is None:
            raise SceneError(f"{self.path}: has no file {name}")
        place, size = f"{self.path}: {name}", member.file_size
        if member.flag_bits & _ENCRYPTED or member.compress_type not in _METHODS:
            raise SceneError(f"{place}: is encrypted, or not packed by 'deflate'; pack it anew")
        if size > _MAX_FILE:
            raise SceneError(f"{place}: would unpack to {size:,} bytes; at most {_MAX_FILE:,} are read")
        if size > self._left:
            raise SceneError(f"{place}: with it more than {_MAX_TOTAL:,} bytes would have been unpacked")
        self._left -= size
        try:
            with self._zip.open(member) as file:
                data = file.read(size)
        except OSError:
            raise
        except Exception as error:
            raise SceneError(f"{place}: cannot be unpacked: {error}") from None
        if len(data) < size:
            raise SceneError(f"{place}: claims {size} bytes but has {len(data)}; it is cut short")
        return data


class Folder:
    """The files below a folder, by names without case, as if it were packed.

    Parameters
    ----------
    path : Path
    """

    def __init__(self, path):
        self.path = path

    def _find(self, name):
        """The file of a name in a folder below, or None."""
        found = self.path
        for part in _key(name).split("/"):
            if not found.is_dir():
                return None
            found = next((entry for entry in sorted(found.iterdir()) if entry.name.lower() == part), None)
            if found is None:
                return None
        return inside(self.path, str(found.relative_to(self.path)))

    def __contains__(self, name):
        found = self._find(name)
        return found is not None and found.is_file()

    def names(self, folder, suffix):
        """As of :class:`Archive`."""
        found = self._find(folder)
        if found is None or not found.is_dir():
            return []
        return sorted(f"{folder}/{entry.name.lower()}" for entry in found.iterdir()
                      if entry.name.lower().endswith(suffix) and entry.is_file())

    def read(self, name):
        """As of :class:`Archive`."""
        found = self._find(name)
        if found is None:
            raise SceneError(f"{self.path}: has no file {name}")
        size = found.stat().st_size
        if size > _MAX_FILE:
            raise SceneError(f"{found}: has {size:,} bytes; at most {_MAX_FILE:,} are read")
        return found.read_bytes()


def read_text(archive, name):
    """The text of a small file in an archive or folder.

    Raises
    ------
    SceneError
        As of :meth:`Archive.read`, or if it is not small.
    """
    data = archive.read(name)
    if len(data) > MAX_TEXT:
        raise SceneError(f"{archive.path}: {name}: has {len(data):,} bytes; of texts at most {MAX_TEXT:,} are read")
    return data.decode("latin-1")
