"""What decides each parameter of the smallest chip for a scene."""

from dataclasses import asdict, replace

from amaranth.utils import exact_log2

from fpu.reciprocal import MAX_FRAC_WIDTH
from rtl.arithmetic import ARITHMETICS, NUMBERS
from rtl.config import ChipConfig
from rtl.program.features import SWITCHES
from sim.scene.shading_image import needed_features

from .errors import BadInput
from .fit_area import FULL, area_of, blocks_of, datapath_tables, smallest_device, speed_of
from .fit_format import VARIANTS, FormatSearch
from .fit_pictures import Pictures
from .fit_reasons import CACHES, Reason, reasons_of
from .fit_speed import Clockwork, SpeedSearch

__all__ = ["Fitting", "is_plain"]

#: The picture by which threads and more are fitted.
_SMALL = 96, 72
#: What is there in full shading of any scene.
_ALWAYS = {"point_lights", "shadows"}


def is_plain(scene):
    """Whether a scene has nothing but colours, which simple shading shows."""
    needs = needed_features(scene, instances=False)
    return not scene.lights and not any(scene.ambient) and not [
        name for name in SWITCHES if getattr(needs, name) and name not in _ALWAYS]


class Fitting:
    """A chip as it is fitted to a scene.

    Parameters
    ----------
    scene, poses, size, flatten
        As of :class:`~tools.fit_pictures.Pictures`.
    quality : Quality
        What pictures must have.
    shading : str or None
        None for what the scene needs.
    depth : int
        Generations of secondary rays that are wanted.
    slower : float
        How many times the cycles of 64 threads it may take.
    latency : int
        Of the memories, in cycles.
    tell, progress : callable
        Are told of each measurement, and of what is being done.

    Attributes
    ----------
    config : ChipConfig
    reasons : list of Reason
    figures : dict
        By name, of the chip and of the full one: areas, cycles and clocks.
    """

    def __init__(self, scene, poses, *, size, quality, shading=None, depth=4, flatten=None, slower=2.0, latency=4,
                 tell=print, progress=lambda text: None):
        self._quality, self._slower, self._tell, self._progress = quality, slower, tell, progress
        self.reasons, self.figures = [], {}
        self._tables, self._whole_tables, self._timed = None, None, None
        plain = is_plain(scene)
        shading, asked = shading or ("simple" if plain else "full"), shading is not None
        self._pictures = Pictures(scene, poses, size, shading=shading, depth=depth, flatten=flatten, progress=progress)
        self._clock = Clockwork(pictures=self._pictures, latency=latency, progress=progress)
        if shading == "simple":
            self._because("shader", "none", "asked for" if asked else "the scene has neither lights nor ambient light, "
                          "and its materials are colours alone")

    def _because(self, what, value, why):
        self.reasons.append(Reason(what, value, why))

    def fit(self, *, has_clock, has_area, is_placed=False):
        """Find the chip.

        Parameters
        ----------
        has_clock : bool
            Whether cycles are measured.
        has_area, is_placed : bool
            Whether the chip and the full one are synthesised, and placed.

        Raises
        ------
        BadInput
            If no format draws well enough.
        """
        pictures = self._pictures
        ways = self._ways(has_area)
        config = self._whole(ways[0], self._depth())
        if has_clock:
            config = self._faster(config)
        else:
            self._because("num_threads", config.num_threads, "the default, as no cycles were measured")
        if has_area:
            config = self._smallest(config, ways)
        self.config = config
        compiled, images = pictures.compiled(config.fmt, stack_depth=config.stack_depth)
        self.reasons += reasons_of(config, compiled, images, size=pictures.size, tried=self._search.tried,
                                   tables=self._whole_tables)
        faults = pictures.faults(config)
        if isinstance(faults, str) or not self._quality.admits(faults):
            raise BadInput(f"the chip that was found does not draw well enough: {faults}; "
                           "ask for more --quality than you need, to leave room")
        self.image_bytes = images[0].num_bytes
        self._because("picture", str(faults), f"wanted: {self._quality}")
        self.faults = faults
        if has_area:
            self._areas(blocks_of(images[0]))
        if has_clock:
            self._cycles()
        if is_placed:
            self._clocks(has_clock)

    def _ways(self, has_area):
        """Chips with a format and a way to compute that draw well enough, the most promising first."""
        def faults_of(fmt, variant):
            self._progress(f"drawing by the model at {fmt}, {variant}")
            return self._pictures.faults(self._chip(fmt, **VARIANTS[variant]))

        search = FormatSearch(faults_of, self._quality, tell=self._tell)
        candidates = search.run()
        if not candidates:
            near = search.best()
            raise BadInput(f"no format of up to {search.most_bits} fraction bits draws this well enough "
                           f"({self._quality}); " + (
                f"what comes nearest is {near[0]}, {near[1]}: {near[2]}; ask for less with --quality" if near else
                "the scene fits none: " + next(iter(search.tried.values()))))
        self.tried = {f"{exponent}.{fraction}, {variant}": faults if isinstance(faults, str) else asdict(faults)
                      for (exponent, fraction, variant), faults in search.tried.items()}
        self._search = search
        # Of tolerances, which cost the same, the least that has the narrowest format.
        seen, ways = set(), []
        for candidate in candidates:
            kind = candidate.variant.split()[0]
            if kind not in seen:
                ways += self._divisions(candidate)
            seen.add(kind)
        if not has_area:
            return ways
        tables = {way: datapath_tables(way, progress=self._progress) for way in ways}
        for way, number in tables.items():
            self._tell(f"{self._name(way)}: {number:,} tables in its datapaths")
        self._tables = {self._name(way): number for way, number in tables.items()}
        return sorted(ways, key=tables.get)

    def _chip(self, fmt, **parameters):
        shader = None
        if self._pictures.is_full:
            shader = replace(needed_features(self._pictures.scene, instances=True), depth=self._pictures.depth)
        return ChipConfig(fmt=fmt, shader=shader, **parameters)

    def _divisions(self, candidate):
        """The candidate's chip, by the ways to divide that draw as well."""
        way = self._chip(candidate.fmt, **VARIANTS[candidate.variant])
        if way.arithmetic != NUMBERS["separate"]:
            return [way]
        by_table, by_reciprocal = (replace(way, arithmetic=NUMBERS[name]) for name in ("table", "reciprocal"))
        # There are no tables for wider fractions.
        if candidate.fmt.frac_width > MAX_FRAC_WIDTH:
            return [way]
        # Quotients by table are the same, bit for bit.
        ways = [by_table]
        if self._is_good(by_reciprocal):
            ways.append(by_reciprocal)
        return ways

    @staticmethod
    def _name(config):
        tolerant = f", tolerant {config.edge_tolerance}" if config.edge_tolerance else ""
        return f"{config.fmt}, {ARITHMETICS[config.arithmetic].name}{tolerant}"

    def _depth(self):
        pictures = self._pictures
        if not pictures.is_full:
            return 0
        needs = needed_features(pictures.scene, instances=True)
        if not needs.children:
            self._because("shader.depth", 0, "no material mirrors, and none lets light through")
            return 0
        bound = self._quality.wrong or 0.0
        for depth in range(pictures.depth):
            self._progress(f"drawing by golden, {depth} generations of secondary rays")
            other = pictures.other_pixels(depth)
            self._tell(f"depth {depth}: {other:.3f} % of golden's pixels differ from those of depth {pictures.depth}")
            if other <= bound:
                self._because("shader.depth", depth, f"{other:.3f} % of golden's pixels differ by more than 8 levels "
                              f"from those of depth {pictures.depth}")
                return depth
        self._because("shader.depth", pictures.depth, "as wanted; less shows in the picture")
        return pictures.depth

    def _whole(self, way, depth):
        """A way to compute with all that scene and size ask for."""
        compiled, images = self._pictures.compiled(way.fmt)
        shader = None if way.shader is None else replace(compiled.needs, depth=depth)
        return self._numbered(replace(way, shader=shader, stack_depth=self._deepest(images),
                                      coord_width=max(4, max(self._pictures.size).bit_length())))

    @staticmethod
    def _deepest(images):
        return max(1, *(image.stack_depth for image in images))

    def _numbered(self, config):
        """A chip whose numbers are wide enough for its images, and whose caches are no larger than the memories."""
        _, images = self._pictures.compiled(config.fmt, stack_depth=config.stack_depth)
        width, default = max(8, *(image.index_width for image in images)), ChipConfig()
        lines = {}
        for name, items in CACHES.items():
            whole = 1 << width - exact_log2(getattr(default, items) if items else 1)
            lines[name] = min(getattr(default, name), whole)
        return replace(config, index_width=width, **lines)

    def _faster(self, config):
        def cycles_of(chip):
            self._progress(f"drawing by the simulated chip, {chip.num_threads} threads")
            return self._clock.cycles(chip, _SMALL)

        search = SpeedSearch(cycles_of, self._slower, is_good=self._is_good, tell=self._tell)
        fitted = self._numbered(search.run(config))
        for name in search.knobs:
            what = "depth of trees" if name == "stack_depth" else name
            self._because(what, getattr(fitted, name), search.why(name, _SMALL))
        self._timed = {"size": list(_SMALL), "first": search.first, "tried": [
            {"parameter": name, "value": value, "cycles": cycles} for (name, value), cycles in search.tried.items()]}
        return fitted

    def _is_good(self, chip):
        faults = self._pictures.faults(chip)
        return not isinstance(faults, str) and self._quality.admits(faults)

    def _smallest(self, config, ways):
        """Of the two most promising ways the one whose whole chip is smaller."""
        chips = [config]
        if len(ways) > 1:
            # With a depth of trees that has been cut the other is cut alike.
            _, images = self._pictures.compiled(ways[1].fmt, stack_depth=config.stack_depth)
            chips.append(self._numbered(replace(config, fmt=ways[1].fmt, arithmetic=ways[1].arithmetic,
                                                edge_tolerance=ways[1].edge_tolerance,
                                                stack_depth=self._deepest(images))))
            if not self._is_good(chips[1]):
                chips.pop()
        areas = {chip: area_of(chip, name=f"the chip at {self._name(chip)}", progress=self._progress)
                 for chip in chips}
        for chip, area in areas.items():
            self._tell(f"{self._name(chip)}: {area.lut:,} tables, {area.ff:,} flip-flops, {area.dsp} multipliers, "
                       f"{area.ebr} block RAMs")
        self._whole_tables = {self._name(chip): area.lut for chip, area in areas.items()}
        return min(chips, key=lambda chip: areas[chip].lut)

    def _areas(self, blocks):
        names = {"tables": "lut", "flip-flops": "ff", "multipliers": "dsp", "block RAMs": "ebr"}
        areas = [area_of(chip, name=name, progress=self._progress)
                 for chip, name in ((self.config, f"the chip at {self._name(self.config)}"), (FULL, "the full chip"))]
        for name, member in names.items():
            self.figures[name] = [getattr(area, member) for area in areas]
        alone, both = smallest_device(areas[0]), smallest_device(areas[0], blocks)
        self._because("device", alone.name if alone else "none", "the smallest ECP5 with room for it")
        self._because("memory", "on the chip" if both else "external",
                      f"beside its image of {blocks} block RAMs the chip fits an {both.name}" if both else
                      f"no ECP5 has {areas[0].ebr + blocks} block RAMs for the chip and its image")

    def _cycles(self):
        self._progress("drawing the whole picture by the simulated chips")
        pictures = self._pictures
        self.figures["cycles a frame"] = [self._clock.cycles(self.config, pictures.size), self._clock.of_full(FULL)]

    def _clocks(self, has_clock):
        speeds = [round(speed_of(chip, name=name, progress=self._progress), 1)
                  for chip, name in ((self.config, "the chip"), (FULL, "the full chip"))]
        self.figures["MHz"] = speeds
        if has_clock:
            self.figures["frames a second"] = [round(1e6 * mhz / cycles, 1) for mhz, cycles in
                                               zip(speeds, self.figures["cycles a frame"], strict=True)]

    def about(self):
        """What is kept beside the chip in its file."""
        found = {"shading": self._pictures.shading, "depth": self._pictures.depth, "image_bytes": self.image_bytes,
                 "quality": str(self._quality), "picture": asdict(self.faults),
                 "because": [asdict(reason) for reason in self.reasons], "formats": self.tried}
        if self.figures:
            found["figures"] = {name: dict(zip(("chip", "full"), pair, strict=True))
                                for name, pair in self.figures.items()}
        for name, member in (("tables_of_datapaths", "_tables"), ("tables_of_chips", "_whole_tables"),
                             ("cycles", "_timed")):
            if getattr(self, member):
                found[name] = getattr(self, member)
        return found
