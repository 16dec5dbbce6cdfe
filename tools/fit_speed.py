"""How few threads, stack entries and fetches do, by cycles of the simulated chip."""

from dataclasses import dataclass, field, replace

from sim.machine import render_rtl

from .engines import Order, model_picture
from .errors import Failure

__all__ = ["KNOBS", "Clockwork", "SpeedSearch"]

#: What a chip may have less of, in this order, and how much, least first. Caches are not among them: up to 512 lines
#: they take the same block RAMs.
KNOBS = {"num_threads": (16, 32), "stack_depth": (8, 16), "num_fetches": (1, 2), "mailbox_entries": (0, 1, 2)}


@dataclass(frozen=True, kw_only=True)
class Clockwork:
    """Cycles by the simulated chip, whose picture must be the model's.

    Parameters
    ----------
    pictures : Pictures
        Of which the first is drawn.
    latency : int
        Of the memories.
    progress : callable
        Is told what is being done.
    """

    pictures: object
    latency: int
    progress: object = lambda text: None

    def cycles(self, config, size):
        """Cycles of a picture.

        Raises
        ------
        Failure
            If it is not the model's picture.
        """
        pictures = self.pictures
        compiled, images = pictures.compiled(config.fmt, stack_depth=config.stack_depth)
        image, (_, camera) = images[0], pictures.poses[0]
        order = Order(engine="rtl", size=size, config=config, shading=pictures.shading, depth=pictures.depth)
        chip = order.chip_for(compiled)
        frame = render_rtl(image, camera, *size, config=chip, latency=self.latency, progress=self.progress)
        model = model_picture(order, image, camera, chip)
        differs = (frame.color != model.color).any(axis=-1) if order.is_full else frame.differs(model)
        if differs.any():
            raise Failure(f"the simulated chip draws {int(differs.sum())} pixels of {size[0]}x{size[1]} other than its "
                          "model; this is a fault of the chip")
        return frame.report["cycles"]

    def of_full(self, config):
        """Cycles of the whole picture by a chip with full shading, whatever the pictures have."""
        pictures = self.pictures
        posed, camera = pictures.poses[0]
        self.progress("drawing by the full chip")
        image = pictures.compile(config.fmt).image(posed, eye=camera.eye, is_full=True)
        frame = render_rtl(image, camera, *pictures.size, config=config, latency=self.latency, progress=self.progress)
        return frame.report["cycles"]


@dataclass(eq=False)
class SpeedSearch:
    """Takes away from a chip, one thing after the other, while it stays fast enough.

    Parameters
    ----------
    cycles_of : callable
        ``cycles_of(config)``.
    slower : float
        How many times the cycles of the chip at the beginning it may take.
    knobs : dict
        As :data:`KNOBS`.
    is_good : callable
        ``is_good(config)``: whether it still draws well enough, asked of shallower trees.
    tell : callable
        Is told of each measurement.

    Attributes
    ----------
    tried : dict
        Cycles by (name, value), None of what does not draw well enough.
    first : int
        Cycles of the chip at the beginning.
    """

    cycles_of: object
    slower: float
    knobs: dict = field(default_factory=lambda: KNOBS)
    is_good: object = lambda config: True
    tell: object = print
    tried: dict = field(default_factory=dict)
    first: int = 0

    def run(self, config):
        """The ChipConfig with less."""
        self.first = first = self.cycles_of(config)
        self.tell(f"{config.num_threads} threads, all of it: {first:,} cycles")
        for name, values in self.knobs.items():
            for value in values:
                if value >= getattr(config, name):
                    break
                less = replace(config, **{name: value})
                if name == "stack_depth" and not self.is_good(less):
                    self.tried[name, value] = None
                    self.tell(f"{name} {value}: does not draw well enough")
                    continue
                self.tried[name, value] = cycles = self.cycles_of(less)
                is_kept = cycles <= self.slower * first
                self.tell(f"{name} {value}: {cycles:,} cycles, {cycles / first:.2f} times"
                          f"{'' if is_kept else ', too slow'}")
                if is_kept:
                    config = less
                    break
        return config

    def why(self, name, size):
        """What was found for a knob, in words."""
        words = "; ".join(f"{value}: {f'{cycles / self.first:.2f}' if cycles else 'not drawn well enough'}"
                          for (knob, value), cycles in self.tried.items() if knob == name)
        small = "×".join(map(str, size))
        return (f"cycles at {small} over those of all: {words}; at most {self.slower:g}" if words else
                "the scene asks for no more")
