"""What decides each parameter of the smallest chip for a scene."""

from dataclasses import asdict, dataclass, fields, replace

from fpu import FloatFormat
from fpu.reciprocal import MAX_FRAC_WIDTH
from rtl.arithmetic import ARITHMETICS
from rtl.config import ChipConfig
from rtl.program.features import ShaderFeatures
from sim.scene.shading_image import needed_features

from .errors import BadInput
from .fit_area import FULL, area_of, blocks_of, datapath_tables, smallest_device, speed_of
from .fit_format import VARIANTS, FormatSearch
from .fit_pictures import Pictures
from .fit_speed import Clockwork, SpeedSearch

__all__ = ["Fitting", "Reason", "is_plain"]

#: The picture by which threads and more are fitted.
_SMALL = 96, 72
_NUMBERS = {arithmetic.name: number for number, arithmetic in enumerate(ARITHMETICS)}
_SWITCHES = tuple(field.name for field in fields(ShaderFeatures) if field.type is bool)
#: What is there in full shading of any scene.
_ALWAYS = {"point_lights", "shadows"}


@dataclass(frozen=True)
class Reason:
    """Why a parameter has its value.

    Parameters
    ----------
    what : str
        The parameter, or what is worth knowing besides.
    value
    why : str
    """

    what: str
    value: object
    why: str


def is_plain(scene):
    """Whether a scene has nothing but colours, which simple shading shows."""
    needs = needed_features(scene, instances=False)
    return not scene.lights and not any(scene.ambient) and not [
        name for name in _SWITCHES if getattr(needs, name) and name not in _ALWAYS]


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
        plain = is_plain(scene)
        shading, asked = shading or ("simple" if plain else "full"), shading is not None
        self._pictures = Pictures(scene, poses, size, shading=shading, depth=depth, flatten=flatten, progress=progress)
        self._clock = Clockwork(pictures=self._pictures, latency=latency, progress=progress)
        # Roots, which lights and mirrors need, go by table.
        self._most_bits = MAX_FRAC_WIDTH if shading == "full" else FloatFormat(8, 23).frac_width
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
        self._explain(config, compiled, images)
        faults = pictures.faults(config)
        if isinstance(faults, str) or not self._quality.admits(faults):
            raise BadInput(f"the chip that was found does not draw well enough: {faults}; "
                           "ask for more --quality than you need, to leave room")
        self._because("picture", str(faults), f"wanted: {self._quality}")
        self.faults = faults
        if has_area:
            self._areas(blocks_of(images[0]))
        if has_clock:
            self._cycles()
        if is_placed:
            self._clocks(has_clock)

    # Format and arithmetic

    def _ways(self, has_area):
        """Chips with a format and a way to compute that draw well enough, the most promising first."""
        def faults_of(fmt, variant):
            self._progress(f"drawing by the model at {fmt}, {variant}")
            return self._pictures.faults(self._chip(fmt, **VARIANTS[variant]))

        search = FormatSearch(faults_of, self._quality, most_bits=self._most_bits, tell=self._tell)
        candidates = search.run()
        if not candidates:
            near = search.best()
            raise BadInput(f"no format of up to {self._most_bits} fraction bits draws this well enough "
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
        if way.arithmetic != _NUMBERS["separate"]:
            return [way]
        by_table, by_reciprocal = (replace(way, arithmetic=_NUMBERS[name]) for name in ("table", "reciprocal"))
        # There are no tables for wider fractions.
        if candidate.fmt.frac_width > MAX_FRAC_WIDTH:
            return [way]
        # Quotients by table are the same, bit for bit.
        ways = [by_table]
        faults = self._pictures.faults(by_reciprocal)
        self._tell(f"{self._name(by_reciprocal)}: {faults}")
        if not isinstance(faults, str) and self._quality.admits(faults):
            ways.append(by_reciprocal)
        return ways

    @staticmethod
    def _name(config):
        tolerant = f", tolerant {config.edge_tolerance}" if config.edge_tolerance else ""
        return f"{config.fmt}, {ARITHMETICS[config.arithmetic].name}{tolerant}"

    # What the scene and the picture's size decide

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
        return replace(way, shader=shader, stack_depth=max(image.stack_depth for image in images) or 1,
                       index_width=max(8, *(image.index_width for image in images)),
                       coord_width=max(4, max(self._pictures.size).bit_length()))

    def _faster(self, config):
        def cycles_of(chip):
            self._progress(f"drawing by the simulated chip, {chip.num_threads} threads")
            return self._clock.cycles(chip, _SMALL)

        def is_good(chip):
            faults = self._pictures.faults(chip)
            return not isinstance(faults, str) and self._quality.admits(faults)

        search = SpeedSearch(cycles_of, self._slower, is_good=is_good, tell=self._tell)
        fitted = search.run(config)
        first, small = search.tried[None], "×".join(map(str, _SMALL))
        for name in search.knobs:
            tried = {value: cycles for (knob, value), cycles in
                     ((key, cycles) for key, cycles in search.tried.items() if key) if knob == name}
            found = getattr(fitted, name)
            words = "; ".join(f"{value}: {'not drawn well enough' if cycles is None else f'{cycles / first:.2f}'}"
                              for value, cycles in tried.items())
            if name == "stack_depth" and found == config.stack_depth:
                continue
            self._because(name, found, f"cycles at {small} over those of {config.num_threads} threads: {words}; "
                          f"at most {self._slower:g}" if words else "the scene asks for no more")
        self._timed = {"size": list(_SMALL), "first": first, "tried": [
            {"parameter": key[0], "value": key[1], "cycles": cycles} for key, cycles in search.tried.items() if key]}
        return fitted

    def _smallest(self, config, ways):
        """Of the two most promising ways the one whose whole chip is smaller."""
        chips = [config]
        if len(ways) > 1:
            whole = self._whole(ways[1], config.shader.depth if config.shader else 0)
            chips.append(replace(config, fmt=whole.fmt, arithmetic=whole.arithmetic,
                                 edge_tolerance=whole.edge_tolerance, index_width=whole.index_width,
                                 stack_depth=min(whole.stack_depth, config.stack_depth)
                                 if config.stack_depth < self._whole(ways[0], 0).stack_depth else whole.stack_depth))
        areas = {chip: area_of(chip, name=f"the chip at {self._name(chip)}", progress=self._progress)
                 for chip in chips}
        for chip, area in areas.items():
            self._tell(f"{self._name(chip)}: {area.lut:,} tables, {area.ff:,} flip-flops, {area.dsp} multipliers, "
                       f"{area.ebr} block RAMs")
        self._whole_tables = {self._name(chip): area.lut for chip, area in areas.items()}
        return min(chips, key=lambda chip: areas[chip].lut)

    def _explain(self, config, compiled, images):
        search, fmt = self._search, config.fmt
        narrower = [f"{exponent}.{fraction} {variant}: {faults}" for (exponent, fraction, variant), faults
                    in search.tried.items() if exponent == fmt.exp_width and fraction == fmt.frac_width - 1]
        self._because("fmt", str(fmt), "the next narrower: " + "; ".join(narrower) + f". {fmt.exp_width} exponent bits "
                      "draw what 8 do" if narrower else "the narrowest that is tried")
        why = "asked for by the format"
        if getattr(self, "_whole_tables", None):
            why = "tables of the whole chip: " + "; ".join(
                f"{name}: {number:,}" for name, number in self._whole_tables.items())
        self._because("arithmetic", ARITHMETICS[config.arithmetic].name, why)
        self._because("edge_tolerance", config.edge_tolerance, "closes the cracks that are left" if
                      config.edge_tolerance else "there are no cracks without")
        if config.shader is not None:
            on = [name for name in _SWITCHES if getattr(config.shader, name)]
            self._because("shader", ", ".join(on), "what lights, materials and meshes of the scene have")
            kinds = len(compiled.scene.lights)
            self._because("lights", kinds or "at the eye", "they lie in memory, up to 256; their kinds are switches")
        deepest = max(image.stack_depth for image in images)
        self._because("second level", "unused" if compiled.is_flat else "used",
                      "no mesh is there twice and nothing moves" if compiled.is_flat else
                      "meshes are there more than once, or move")
        if not any(reason.what == "stack_depth" for reason in self.reasons):
            self._because("stack_depth", config.stack_depth, f"the deepest of the scene's kd-trees has {deepest} "
                          "levels below its root, and no ray puts off more nodes than that, wherever it goes")
        memories = {name: len(getattr(images[0], name)) for name in images[0].bytes_of_memories}
        name = max(memories, key=memories.get)
        self._because("index_width", config.index_width, f"the largest memory, {name}, has {memories[name]:,} items")
        self._because("coord_width", config.coord_width, f"the picture has {max(self._pictures.size)} pixels a side")
        self._because("caches", "default", "up to 512 lines of a cache take the same block RAMs")
        self._because("memory", f"{images[0].num_bytes:,} bytes", f"{blocks_of(images[0])} block RAMs, if on the chip")

    # What it takes

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
        found = {"quality": str(self._quality), "picture": asdict(self.faults),
                 "because": [asdict(reason) for reason in self.reasons], "formats": self.tried}
        if self.figures:
            found["figures"] = {name: dict(zip(("chip", "full"), pair, strict=True))
                                for name, pair in self.figures.items()}
        for name, member in (("tables_of_datapaths", "_tables"), ("tables_of_chips", "_whole_tables"),
                             ("cycles", "_timed")):
            if hasattr(self, member):
                found[name] = getattr(self, member)
        return found
