"""The ECP5 devices."""

from dataclasses import dataclass

__all__ = ["DEVICES", "Device"]


@dataclass(frozen=True, kw_only=True)
class Device:
    """One of a family, in a package.

    What it has is by Lattice, *ECP5 and ECP5-5G Family Data Sheet* (FPGA-DS-02012), table 1.1, and the same as in
    nextpnr's database.

    Parameters
    ----------
    name : str
        As Lattice writes it.
    option : str
        Of nextpnr, that chooses it.
    package : str
        All have the default, the largest that the smallest device has.
    router : str
        Of nextpnr; empty for its default, which takes several times as long for a design that fills a large device.
    lut, dsp, ebr : int
        How many four-input tables (and as many flip-flops), 18×18 multipliers and block RAMs it has.
    """

    name: str
    option: str
    package: str = "CABGA381"
    router: str = ""
    lut: int
    dsp: int
    ebr: int

    def route(self, *, target_mhz):
        """Arguments of nextpnr for a design out of context."""
        router = ("--router", self.router) if self.router else ()
        return (self.option, "--package", self.package, "--out-of-context", "--timing-allow-fail",
                "--freq", str(target_mhz), *router)


#: By name.
DEVICES = {device.name: device for device in (
    Device(name="LFE5U-25F", option="--25k", lut=24288, dsp=28, ebr=56),
    Device(name="LFE5U-45F", option="--45k", router="router2", lut=43848, dsp=72, ebr=108),
    Device(name="LFE5U-85F", option="--85k", router="router2", lut=83640, dsp=156, ebr=208),
)}
