"""The shaders of a pipeline, each for its part of the threads."""

from amaranth.hdl import Cat, Module
from amaranth.lib import wiring
from amaranth.lib.wiring import Out
from amaranth.utils import exact_log2

from .layout import with_token
from .microcode import Op
from .queue import Queue, merged
from .shader import Shader

__all__ = ["Shaders"]


class Shaders(wiring.Component):
    """Several shaders that look like one: thread n is worked for by shader n modulo their number.

    What they share, the transformation unit, caches and the way to traversal, each of them gets in turn.

    Parameters
    ----------
    num_shaders : int
        How many, a power of two.
    parameters
        Of each :class:`~rtl.shader.Shader`.

    Members
    -------
    record_address, record, position_address, position : arrays, one for each shader
    busy : how many have taken up an instruction

    All others are those of a :class:`~rtl.shader.Shader`.
    """

    _EACH = ("record_address", "record", "position_address", "position")

    def __init__(self, *, num_shaders, **parameters):
        self._bank_bits = exact_log2(num_shaders)
        self._num_threads = parameters["num_threads"]
        self._shaders = [Shader(**parameters, bank_bits=self._bank_bits) for _ in range(num_shaders)]
        self._has_textures = Op.TEXTURE in parameters["program"].ops
        members = self._shaders[0].signature.members
        super().__init__({
            **members,
            **{name: members[name].array(num_shaders) for name in self._EACH},
            "busy": Out(range(num_shaders + 1)),
        })

    def elaborate(self, platform):
        m = Module()
        shaders = self._shaders
        for number, shader in enumerate(shaders):
            m.submodules[f"shader{number}"] = shader
            m.d.comb += [shader.camera.eq(self.camera), shader.stepped.eq(self.stepped),
                         self.record_address[number].eq(shader.record_address),
                         shader.record.eq(self.record[number]),
                         self.position_address[number].eq(shader.position_address),
                         shader.position.eq(self.position[number])]
            if len(shaders) > 1:
                mine = self.stepped.tag.token.thread[:self._bank_bits] == number
                m.d.comb += shader.stepped.valid.eq(self.stepped.valid & mine)
        m.d.comb += [self.idle.eq(Cat(shader.idle for shader in shaders).all()),
                     self.busy.eq(sum(shader.busy for shader in shaders))]
        for name in ("step", "limit", "load", "pixel", *(["texture"] if self._has_textures else [])):
            streams = [getattr(shader, name) for shader in shaders]
            wiring.connect(m, merged(m, f"{name}_merge", streams), wiring.flipped(getattr(self, name)))
        self._distribute(m, "primary", lambda payload: payload.token.thread)
        self._distribute(m, "packet", lambda payload: payload.thread)
        self._distribute(m, "loaded", lambda payload: payload.payload.token.thread)
        if self._has_textures:
            self._distribute(m, "texel", lambda payload: payload.payload.token.thread)
        self._take_turns(m)
        return m

    def _distribute(self, m, name, thread):
        """A stream to the shader whose thread it is about."""
        source = getattr(self, name)
        bank = thread(source.payload)[:self._bank_bits]
        for number, shader in enumerate(self._shaders):
            target = getattr(shader, name)
            mine = bank == number if self._bank_bits else 1
            m.d.comb += [target.payload.eq(source.payload), target.valid.eq(source.valid & mine)]
            with m.If(mine):
                m.d.comb += source.ready.eq(target.ready)

    def _take_turns(self, m):
        """Packets that start or have finished: one a cycle, wherever they come from."""
        if len(self._shaders) == 1:
            shader, = self._shaders
            for name in ("start", "finished"):
                wiring.connect(m, getattr(shader, name), wiring.flipped(getattr(self, name)))
            m.d.comb += self.shared.eq(shader.shared)
            return
        token = self.start.payload.shape()
        for name, shape in (("start", with_token(token, shared=1)), ("finished", with_token(token))):
            waiting = []
            for number, shader in enumerate(self._shaders):
                queue = Queue(shape, depth=self._num_threads, always_ready=True)
                m.submodules[f"{name}_queue{number}"] = queue
                source = getattr(shader, name)
                m.d.comb += [queue.i.payload.token.eq(source.payload), queue.i.valid.eq(source.valid)]
                if name == "start":
                    m.d.comb += queue.i.payload.shared.eq(shader.shared.shared)
                waiting.append(queue.o)
            turn, out = merged(m, f"{name}_merge", waiting), getattr(self, name)
            m.d.comb += [turn.ready.eq(1), out.payload.eq(turn.payload.token), out.valid.eq(turn.valid)]
            if name == "start":
                m.d.comb += [self.shared.valid.eq(turn.valid), self.shared.thread.eq(turn.payload.token.thread),
                             self.shared.shared.eq(turn.payload.shared)]
