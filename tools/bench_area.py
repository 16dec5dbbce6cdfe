"""What the chips of the paper's tables take of an LFE5U-85F."""

from dataclasses import asdict

from boards.chip import DEVICE, chip_design
from boards.packing import pack
from rtl.dynrtc import DynRTC

from .bench_chips import CHIPS, chip_digest

__all__ = ["area_rows"]


def area_rows(*, names, earlier, console):
    """Areas by chip; of those whose sources have changed, the others as before. A synthesis takes minutes.

    Parameters
    ----------
    names : list of str
        Of the chips.
    earlier : dict
        What was returned before.
    console : rich.console.Console
        For progress.

    Raises
    ------
    ToolError
        If a tool is missing or fails.
    """
    found = {name: area for name, area in earlier.items() if name in CHIPS}
    for name in names:
        chip = CHIPS[name]
        digest = chip_digest(chip.config, latency=chip.latency)
        if found.get(name, {}).get("digest") != digest:
            console.print(f"synthesis of {name}", highlight=False)
            area = asdict(pack(chip_design(DynRTC(chip.config), name=name)))
            found[name] = {**area, "digest": digest,
                           "of": {place: getattr(DEVICE, place) for place in ("name", "lut", "dsp", "ebr")}}
    return found
