"""What the units of picture and host take of an ECP5, and how fast each is there alone."""

from pathlib import Path

import click
from amaranth.hdl import DomainRenamer

from boards.chip import WITHOUT_CHECKS
from boards.design import design_of
from boards.device import DEVICES
from boards.ecp5 import place
from boards.toolchain import versions
from rtl.host.host_link import HostLink
from rtl.sdram.timing import SLOWEST
from rtl.video.color_bars import ColorBars
from rtl.video.line_buffer import LineBuffer
from rtl.video.mode import XGA
from rtl.video.serializer import Serializer
from rtl.video.timing_generator import TimingGenerator
from rtl.video.tmds_encoder import TmdsEncoder
from tools.results import earlier_results, json_text, write_texts

GRADE = 6


class SerializerOfOneClock(Serializer):
    """As if both clocks were the fast one, by which all paths are judged."""

    latency = 1

    def elaborate(self, platform):
        return DomainRenamer({"pixel": "sync", "shift": "sync"})(super().elaborate(platform))


#: By name: a component, and the clock in MHz that it must have
UNITS = {
    "TimingGenerator": lambda: (TimingGenerator(XGA), 65),
    "ColorBars": lambda: (ColorBars(XGA), 65),
    "LineBuffer": lambda: (LineBuffer(XGA, scale=2), 65),
    "TmdsEncoder": lambda: (TmdsEncoder(), 65),
    "Serializer": lambda: (SerializerOfOneClock(num_channels=4), 325),
    "HostLink": lambda: (HostLink(divisor=42, word_width=SLOWEST.word_width, num_registers=8, num_values=8), 125),
}


@click.command()
@click.option("--device", default="LFE5U-25F", show_default=True, type=click.Choice(list(DEVICES)))
@click.option("--seeds", default="1,2", show_default=True, help="Of the placer, separated by commas")
@click.option("--only", multiple=True, type=click.Choice(list(UNITS)))
@click.option("-o", "--output", type=click.Path(dir_okay=False, path_type=Path), show_default=True,
              default="docs/results/dvi_host_ecp5.json", help="JSON to add the result to")
def main(device, seeds, only, output):
    """Place and route each unit by itself, speed grade 6."""
    for name in only or UNITS:
        component, needed = UNITS[name]()
        if not hasattr(component, "latency"):
            component.latency = 0
        design = design_of(component, name=name, synthesis=WITHOUT_CHECKS, device=DEVICES[device])
        runs = {seed: place(design, grade=GRADE, seed=seed) for seed in map(int, seeds.split(","))}
        placed, speeds = next(iter(runs.values())), [run.fmax_mhz for run in runs.values()]
        result = {"device": device, "grade": GRADE, "needed_mhz": needed, "worst_mhz": round(min(speeds), 1),
                  "best_mhz": round(max(speeds), 1), "seeds": list(runs), "lut": placed.lut, "ff": placed.ff,
                  "dsp": placed.dsp, "ebr": placed.ebr, "tools": versions()}
        click.echo(f"{name}: {result}")
        write_texts({output: json_text({**earlier_results(output), name: result})})


if __name__ == "__main__":
    main()
