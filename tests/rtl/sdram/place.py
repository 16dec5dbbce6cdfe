"""What a whole memory system takes of an ECP5, and how fast it is there."""

import json
from pathlib import Path

import click

from boards.chip import WITHOUT_CHECKS
from boards.design import design_of
from boards.device import DEVICES
from boards.ecp5 import critical_path, place
from boards.toolchain import versions
from rtl.config import ChipConfig
from rtl.memory_ports import memory_ports
from rtl.program.features import ShaderFeatures
from rtl.sdram.memory import SdramMemory
from rtl.sdram.timing import SLOWEST, SdramTiming
from tools.results import earlier_results, json_text, write_texts

GRADE = 6


def whole_memory(*, clock_mhz):
    """The memory of a chip with textures: its ports, one for pixels and one for a host's words, and a display."""
    readers = {**memory_ports(ChipConfig(shader=ShaderFeatures(textures=True))), "host": (1, SLOWEST.word_width)}
    return SdramMemory(timing=SdramTiming(SLOWEST, clock_mhz=clock_mhz), readers=readers, num_writers=2, display=True)


@click.command()
@click.option("--clock", default=125.0, show_default=True, help="MHz that distances of commands are counted for")
@click.option("--device", default="LFE5U-25F", show_default=True, type=click.Choice(list(DEVICES)))
@click.option("--seeds", default="1,2", show_default=True, help="Of the placer, separated by commas")
@click.option("-o", "--output", type=click.Path(dir_okay=False, path_type=Path), help="JSON to add the result to")
def main(clock, device, seeds, output):
    """Place and route a whole memory system by itself, speed grade 6."""
    design = design_of(whole_memory(clock_mhz=clock), name="SdramMemory", synthesis=WITHOUT_CHECKS,
                       device=DEVICES[device])
    speeds = {}
    for seed in map(int, seeds.split(",")):
        placed = place(design, grade=GRADE, seed=seed)
        path = critical_path(design, grade=GRADE, seed=seed)
        speeds[seed] = placed.fmax_mhz
        click.echo(f"seed {seed}: {placed.fmax_mhz:.1f} MHz, {placed.lut} LUT, {placed.ff} FF, {placed.ebr} EBR")
        click.echo(f"  {path.words}\n  {' '.join(path.through)}")
    result = {"device": device, "grade": GRADE, "clock_mhz": clock, "worst_mhz": min(speeds.values()),
              "best_mhz": max(speeds.values()), "seeds": list(speeds), "lut": placed.lut, "ff": placed.ff,
              "dsp": placed.dsp, "ebr": placed.ebr, "tools": versions()}
    if output:
        write_texts({output: json_text({**earlier_results(output), "ecp5": result})})
    else:
        click.echo(json.dumps(result))


if __name__ == "__main__":
    main()
