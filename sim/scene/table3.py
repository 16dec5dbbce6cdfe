"""The nine scenes of the paper's Table 3: where each is to be had, its view, and what the paper has measured on it."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from .camera import Camera
from .error import SceneError
from .loader import load_scene
from .quake_players import quake_players_scene
from .room import room_scene
from .scene import Scene
from .stand_in import field_scene, hall_scene
from .sunflowers import sunflowers_scene

__all__ = ["LARGE", "PAPER_MHZ", "SIZE", "TABLE3", "LoadedScene", "PaperRow", "TableScene"]

#: Pictures of Table 3 and of Table 4.
SIZE, LARGE = (512, 384), (1024, 768)
#: Clock of the paper's prototype.
PAPER_MHZ = 90.0


@dataclass(frozen=True, kw_only=True)
class PaperRow:
    """What the paper has of a scene, primary rays with textures by one pipeline.

    Parameters
    ----------
    triangles, objects : int
    fps, openrt_fps : float
        Frames a second at :data:`SIZE`, of the chip and of OpenRT on a Pentium 4 of 2.66 GHz (Table 3).
    large_fps : float
        Frames a second at :data:`LARGE` (Table 4).
    busy : tuple of 4 int
        Per cent of the cycles that traversal, list, transformation and intersection are at work.
    hit : tuple of 3 int
        Per cent of the accesses to nodes, lists and matrices that hit.
    megabytes : tuple of 2 int
        10⁶ bytes a second of DynRTC and of shading at :data:`LARGE`.
    """

    triangles: int
    objects: int
    fps: float
    openrt_fps: float
    large_fps: float
    busy: tuple
    hit: tuple
    megabytes: tuple

    def fps_at(self, size):
        """Frames a second at :data:`SIZE` or :data:`LARGE`, None at another size."""
        return {SIZE: self.fps, LARGE: self.large_fps}.get(tuple(size))

    @property
    def cycles_per_ray(self):
        """Clock cycles of a ray at :data:`SIZE`: PAPER_MHZ·10⁶ ÷ (fps · pixels)."""
        return 1e6 * PAPER_MHZ / (self.fps * SIZE[0] * SIZE[1])

    @property
    def bytes_per_ray(self):
        """Bytes of a ray at :data:`LARGE`, of DynRTC and of shading."""
        return tuple(1e6 * rate / (self.large_fps * LARGE[0] * LARGE[1]) for rate in self.megabytes)


@dataclass(frozen=True, eq=False)
class LoadedScene:
    """A scene with its views, and whether it is a real one, not a stand-in."""

    scene: Scene
    cameras: list
    is_real: bool

    @property
    def camera(self):
        """The view that it is measured in, the first."""
        return self.cameras[0]


@dataclass(frozen=True, kw_only=True)
class TableScene:
    """A row of Table 3.

    Parameters
    ----------
    name : str
        As in the paper.
    files : tuple of str
        What it is read from, in the folder of scenes; empty if it is only built in.
    load_files : callable
        From the folder to the Scene.
    view : str or None
        Name of its views in the folder's cameras.json.
    source : str
        What the scene is and where a person gets it.
    stand_in : callable
        Gives a Scene of about the paper's size where the files are missing.
    paper : PaperRow
    """

    name: str
    files: tuple = ()
    load_files: Callable | None = None
    view: str | None = None
    source: str
    stand_in: Callable
    paper: PaperRow

    def is_in(self, folder):
        """Whether all files are in ``folder``, a path or None."""
        return folder is not None and bool(self.files) and all((Path(folder) / file).exists() for file in self.files)

    def load(self, folder=None):
        """The LoadedScene: of the files, if all are in ``folder``, else the stand-in in its own views.

        Raises
        ------
        SceneError
            If a file is broken, or cameras.json lacks the view.
        """
        if not self.is_in(folder):
            scene = self.stand_in()
            return LoadedScene(scene, scene.cameras or [scene.default_camera()], False)
        return LoadedScene(self.load_files(Path(folder)), self._cameras(Path(folder) / "cameras.json"), True)

    def _cameras(self, path):
        try:
            views = json.loads(path.read_text())[self.view]
            return [Camera(view["eye"], view["at"], view["up"], view["hfov_deg"])
                    for view in (views[0], *views[1:])]
        except OSError as error:
            raise SceneError(f"{path}: {error.strerror}; it has the view '{self.view}' of {self.files[0]}") from error
        except (ValueError, LookupError, TypeError) as error:
            raise SceneError(f"{path}: has no view '{self.view}' with eye, at, up and hfov_deg") from error


def _file(name):
    return {"files": (name,), "load_files": lambda folder: load_scene(folder / name)}


_OPENARENA = "of OpenArena (Debian's packages of it, GPL-2+)"
_PLAYERS = ("openarena/quake3-oa_dm5.pk3", "openarena/players.pk3")

#: By name, in the paper's order. Office's MB/s of shading is corrected: its total contradicts the printed one.
TABLE3 = {row.name: row for row in (
    TableScene(
        name="Scene6", **_file("scene6_simple_room/simple_room.obj"), view="scene6", stand_in=room_scene,
        source="the simple room of the Radiance tutorial by Greg Ward (radiance-online.org), as triangles",
        paper=PaperRow(triangles=806, objects=1, fps=60.8, openrt_fps=12.9, large_fps=15.3, busy=(68, 16, 85, 41),
                       hit=(99, 97, 99), megabytes=(8, 218))),
    TableScene(
        name="Castle", **_file("openarena/castle-oa_shouse.pk3"), view="castle",
        stand_in=lambda: hall_scene(20_891, num_objects=8), source=f"the map oa_shouse {_OPENARENA}",
        paper=PaperRow(triangles=20_891, objects=8, fps=23.8, openrt_fps=9.2, large_fps=5.9, busy=(73, 18, 74, 48),
                       hit=(99, 82, 94), megabytes=(50, 138))),
    TableScene(
        name="Office", **_file("office_laas_grande_salle/grande_salle.obj"), view="office",
        stand_in=lambda: hall_scene(34_312, num_objects=1),
        source="the hall grande_salle of MORSE by LAAS-CNRS/ONERA (Debian package morse-simulator-data, BSD-3-clause)",
        paper=PaperRow(triangles=34_312, objects=1, fps=48.9, openrt_fps=10.4, large_fps=12.4, busy=(76, 16, 72, 36),
                       hit=(99, 71, 90), megabytes=(69, 177))),
    TableScene(
        name="Quake3", **_file("openarena/quake3-oa_dm5.pk3"), view="quake3",
        stand_in=lambda: hall_scene(39_424, num_objects=1), source=f"the map oa_dm5 {_OPENARENA}",
        paper=PaperRow(triangles=39_424, objects=1, fps=33.6, openrt_fps=11.1, large_fps=8.5, busy=(87, 15, 45, 21),
                       hit=(99, 49, 79), megabytes=(104, 197))),
    TableScene(
        name="Quake3-p", files=_PLAYERS, load_files=quake_players_scene, view="quake3p",
        stand_in=lambda: hall_scene(52_790, num_objects=17), source=f"the map oa_dm5 with 16 players {_OPENARENA}",
        paper=PaperRow(triangles=52_790, objects=17, fps=26.7, openrt_fps=7.9, large_fps=6.8, busy=(92, 13, 35, 16),
                       hit=(99, 66, 82), megabytes=(65, 157))),
    TableScene(
        name="UT2003", **_file("openarena/ut-oacmpdm1.pk3"), view="ut",
        stand_in=lambda: hall_scene(52_479, num_objects=1),
        source="the map oacmpdm1 by C. Pederiva and L. Balducchi of OpenArena's community maps (Debian's packages of "
               "OpenArena, GPL-2+)",
        paper=PaperRow(triangles=52_479, objects=1, fps=25.4, openrt_fps=8.0, large_fps=6.5, busy=(82, 19, 66, 42),
                       hit=(98, 63, 86), megabytes=(105, 152))),
    TableScene(
        name="Conference", **_file("conference/conference.obj"), view="conference",
        stand_in=lambda: hall_scene(282_805, num_objects=54),
        source="the conference room by Anat Grynberg and Greg Ward (radiance-online.org), as triangles",
        paper=PaperRow(triangles=282_805, objects=54, fps=22.1, openrt_fps=8.1, large_fps=5.7, busy=(89, 25, 51, 28),
                       hit=(98, 63, 78), megabytes=(135, 132))),
    TableScene(
        name="Terrain", **_file("terrain.glb"), view="terrain",
        stand_in=lambda: field_scene(10_469_866, num_objects=264),
        source="the course frozen_river by Jasmin Patry (Debian package extremetuxracer-data, GPL-2+) with bushes by "
               "Scopia Visual Interfaces Systems (Debian package sweethome3d-furniture, CC-BY-3.0)",
        paper=PaperRow(triangles=10_469_866, objects=264, fps=15.9, openrt_fps=3.5, large_fps=4.2,
                       busy=(80, 27, 34, 18), hit=(97, 27, 43), megabytes=(283, 98))),
    TableScene(
        name="SunCOR", stand_in=sunflowers_scene,
        source="never published; the built-in scene sunflowers has as many triangles and objects",
        paper=PaperRow(triangles=187_145_136, objects=5_622, fps=32.1, openrt_fps=7.5, large_fps=8.7,
                       busy=(46, 36, 29, 12), hit=(90, 2, 6), megabytes=(513, 202))),
)}
