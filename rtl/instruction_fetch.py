"""From a ray that is ready to its next instruction with operands."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from .layout import PACKET_RAYS, camera_layout, thread_slots, thread_width
from .microcode import Lane, counter_width, instruction_layout
from .queue import Queue
from .register_file import RegisterFile, lanes_layout

__all__ = ["InstructionFetch", "ray_token_layout"]


def ray_token_layout(*, num_threads, program, stack_depth):
    """A ray's ticket in the shader.

    Members
    -------
    thread, ray : which ray it is
    counter : number of its next instruction
    sp : registers on its stack
    hit : the record of its last hit holds a distance
    """
    return data.StructLayout({"thread": thread_width(num_threads), "ray": range(PACKET_RAYS),
                              "counter": counter_width(program), "sp": range(stack_depth + 1), "hit": 1})


class InstructionFetch(wiring.Component):
    """Takes rays in turn, one instruction of each; in two cycles where it is wide, else in one.

    A ray has one instruction under way at a time, so that none waits for another's result.

    Parameters
    ----------
    fmt : :class:`~fpu.FloatFormat`
        Format of floats.
    num_threads : int
        Threads, of four rays each.
    program : :class:`~rtl.microcode.Program`
        What rays do.
    stack_depth : int
        Registers on a ray's stack.
    bank_bits : int
        See :class:`~rtl.register_file.RegisterFile`.

    Members
    -------
    camera : see :class:`~rtl.register_file.RegisterFile`
    ray : stream of :func:`ray_token_layout`: rays that are ready
    admit : another instruction may be taken up
    under_way : instructions that are taken up and have not come out
    out : ``{"valid", "token", "instruction", "a", "b", "c", "x"}``; lanes of x are selected and negated
    write : a register
    """

    #: Instructions that can be under way.
    capacity = 6

    def __init__(self, *, fmt, num_threads, program, stack_depth, bank_bits=0):
        self._fmt = fmt
        self._program = program
        self._num_rays = PACKET_RAYS * thread_slots(num_threads, bank_bits)
        self._token = token = ray_token_layout(num_threads=num_threads, program=program, stack_depth=stack_depth)
        self._instruction = instruction = instruction_layout(len(program.instructions))
        self._registers = RegisterFile(fmt=fmt, num_threads=num_threads, literals=program.literals,
                                       bank_bits=bank_bits)
        lanes = lanes_layout(fmt)
        self._out = data.StructLayout({"valid": 1, "token": token, "instruction": instruction,
                                       **{name: lanes for name in "abcx"}})
        super().__init__({
            "camera": In(camera_layout(fmt)),
            "ray": In(stream.Signature(token, always_ready=True)),
            "admit": In(1),
            "under_way": Out(range(self.capacity + 1)),
            "out": Out(self._out),
            "write": In(self._registers.write.shape()),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.registers = registers = self._registers
        m.submodules.ready = ready = Queue(self._token, depth=self._num_rays, always_ready=True)
        m.submodules.program = program = memory.Memory(
            shape=self._instruction, depth=max(len(self._program.instructions), 2), init=self._program.instructions)
        fetch = program.read_port()
        m.d.comb += [
            ready.i.payload.eq(self.ray.payload),
            ready.i.valid.eq(self.ray.valid),
            registers.camera.eq(self.camera),
            registers.write.eq(self.write),
        ]

        # An instruction that reads two registers more stays where it is for a second cycle, and all behind it wait.
        taken, decoded = Signal(self._token, reset_less=True), Signal(self._token, reset_less=True)
        instruction = Signal(self._instruction, reset_less=True)
        is_taken, is_decoded, second = Signal(), Signal(), Signal()
        stall, goes_on = Signal(), Signal()
        take = Signal()
        m.d.comb += [
            stall.eq(is_decoded & instruction.is_wide & ~second),
            goes_on.eq(is_decoded & ~stall),
            take.eq(ready.o.valid & self.admit & ~stall),
            ready.o.ready.eq(take),
            fetch.addr.eq(ready.o.payload.counter),
            fetch.en.eq(~stall),
        ]
        m.d.sync += second.eq(stall)
        with m.If(~stall):
            m.d.sync += [taken.eq(ready.o.payload), is_taken.eq(take),
                         decoded.eq(taken), is_decoded.eq(is_taken), instruction.eq(fetch.data)]
        for port, (first, other) in enumerate((("a", "b"), ("x", "c"))):
            m.d.comb += [
                registers.read[port].valid.eq(is_decoded),
                registers.read[port].thread.eq(decoded.thread),
                registers.read[port].ray.eq(decoded.ray),
                registers.read[port].number.eq(Mux(second, instruction[other], instruction[first])),
            ]

        stages = registers.read_latency
        beside = data.StructLayout({"valid": 1, "token": self._token, "instruction": self._instruction, "second": 1})
        reading = [Signal(beside, name=f"reading{stage}") for stage in range(stages + 1)]
        m.d.comb += [reading[0].valid.eq(goes_on), reading[0].token.eq(decoded),
                     reading[0].instruction.eq(instruction), reading[0].second.eq(second)]
        for stage in range(stages):
            m.d.sync += reading[stage + 1].eq(reading[stage])
        read = reading[stages]
        held = [Signal(lanes_layout(self._fmt), name=f"held{port}", reset_less=True) for port in range(2)]
        m.d.sync += [held[port].eq(registers.value[port]) for port in range(2)]

        x = Signal(lanes_layout(self._fmt))
        m.d.comb += x.eq(Mux(read.second, held[1].as_value(), registers.value[1].as_value()))
        out = Signal(self._out)
        m.d.sync += [
            out.valid.eq(read.valid),
            out.token.eq(read.token),
            out.instruction.eq(read.instruction),
            out.a.eq(Mux(read.second, held[0].as_value(), registers.value[0].as_value())),
            # Only where they are zero they are not read.
            *(operand.eq(Mux(read.second, value.as_value(), 0))
              for operand, value in zip((out.b, out.c), registers.value, strict=True)),
            *(out.x[lane].eq(self._selected(m, x, read.instruction, lane)) for lane in range(3)),
            self.under_way.eq(self.under_way + take - out.valid),
        ]
        m.d.comb += self.out.eq(out)
        return m

    def _selected(self, m, x, instruction, lane):
        """Lane of x that is selected, with its sign changed or not."""
        width, fmt = x.shape().elem_shape, self._fmt
        selected = Signal(width, name=f"selected{lane}")
        with m.Switch(instruction.select[lane]):
            for choice in (Lane.X, Lane.Y, Lane.Z):
                with m.Case(choice):
                    m.d.comb += selected.eq(x[choice.value])
            with m.Case(Lane.ONE):
                m.d.comb += selected.eq(fmt.const(1.0))
        negated = Signal(width, name=f"negated{lane}")
        m.d.comb += negated.eq(selected ^ (instruction.negate[lane] << fmt.width - 1))
        return negated
