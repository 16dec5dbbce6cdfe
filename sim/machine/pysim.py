"""The same board in Amaranth's own simulator, for small pictures."""

import time
from contextlib import nullcontext

import numpy as np
from amaranth.hdl import Signal
from amaranth.sim import Simulator

from rtl.dynrtc import DynRTC, counter_names
from rtl.memory_ports import memory_ports

from .bench import HangError
from .machine import camera_words, decode_pixels, memory_words, report_of

__all__ = ["render_pysim"]


class _Memory:
    """Answers line requests in order, a word a cycle, ``latency`` cycles after the request."""

    def __init__(self, words, line_words, latency):
        self.words, self.line_words, self.latency = words, line_words, latency
        self.pending = []
        self.words_read = 0

    def step(self, now, request):
        if request is not None:
            first = request * self.line_words
            start = max([now + self.latency] + [due + 1 for due, _ in self.pending[-1:]])
            self.pending += [(start + k, int(word)) for k, word in
                             enumerate(self.words[first:first + self.line_words])]
        if self.pending and self.pending[0][0] <= now:
            self.words_read += 1
            return self.pending.pop(0)[1]
        return None


def render_pysim(image, camera, width, height, *, config, background=(0, 0, 0), latency=4, wave=None,
                 hang_cycles=20_000, progress=lambda text: None):
    """What the chip draws in Amaranth's simulator, thousands of times slower than the Verilated one.

    Parameters
    ----------
    image, camera, width, height, config, background, latency, progress
        As for :func:`~sim.machine.machine.render_rtl`.
    wave : path, optional
        Where to write a VCD of all cycles.
    hang_cycles : int
        So many cycles without a pixel are a hang.

    Raises
    ------
    HangError
        If no pixel comes for ``hang_cycles``.
    """
    dut = DynRTC(config)
    memories = {}
    for name, (line_words, _) in memory_ports(config).items():
        words = memory_words(image, name, config).reshape(-1)
        memories[name] = _Memory(np.pad(words, (0, -len(words) % line_words)), line_words, latency)
    payload_width = Signal(dut.pixel.payload.shape()).shape().size
    pixels = np.zeros((height, width, -(-payload_width // 32)), np.uint32)
    counters = {}
    mask = (1 << config.coord_width) - 1

    async def board(ctx):
        words = camera_words(image, camera, width)
        ctx.set(dut.camera.as_value(), sum(int(word) << 32 * k for k, word in enumerate(words)))
        red, green, blue = background
        for signal, value in ((dut.root, image.root), (dut.width, width), (dut.height, height),
                              (dut.background, red << 16 | green << 8 | blue), (dut.pixel.ready, 1)):
            ctx.set(signal, value)
        requests = {name: getattr(dut, f"{name}_request") for name in memories}
        answers = {name: getattr(dut, f"{name}_data") for name in memories}
        for request in requests.values():
            ctx.set(request.ready, 1)
        ctx.set(dut.start, 1)
        await ctx.tick()
        ctx.set(dut.start, 0)
        now = quiet_since = 0
        while not ctx.get(dut.ready):
            for name, memory in memories.items():
                request = requests[name]
                word = memory.step(now, ctx.get(request.payload) if ctx.get(request.valid) else None)
                ctx.set(answers[name].valid, word is not None)
                ctx.set(answers[name].payload, word or 0)
            if ctx.get(dut.pixel.valid):
                value = ctx.get(dut.pixel.payload.as_value())
                x, y = value & mask, value >> config.coord_width & mask
                pixels[y, x] = [value >> 32 * k & 0xFFFFFFFF for k in range(pixels.shape[2])]
                quiet_since = now
            if now - quiet_since > hang_cycles:
                raise HangError(f"the chip has put out no pixel since cycle {quiet_since}")
            await ctx.tick()
            now += 1
        counters.update({name: ctx.get(dut.counters[name]) for name in counter_names(config)})

    progress("elaborating")
    simulator = Simulator(dut)
    simulator.add_clock(1e-8)
    simulator.add_testbench(board)
    progress("drawing")
    begin = time.perf_counter()
    with simulator.write_vcd(str(wave)) if wave else nullcontext():
        simulator.run()
    rate = counters["cycles"] / (time.perf_counter() - begin)
    frame = decode_pixels(pixels, image, config)
    frame.report.update(report_of(counters, {name: 4 * memory.words_read for name, memory in memories.items()},
                                  width * height, rate, config))
    return frame
