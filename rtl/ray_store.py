"""The rays of all threads, kept twice: by axis for traversal, by vector for transformation."""

from amaranth.hdl import Assert, Cat, Module, Signal
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from .block_memory import BlockMemory
from .layout import PACKET_RAYS, Axis, thread_width, vector_layout

__all__ = ["RayStore", "ray_store_ports"]


def ray_store_ports(*, fmt, num_threads):
    """Shapes of the members of a :class:`RayStore`.

    A write with ``own`` is of the origin of one ray, one without of the origin of all.
    """
    vector = {"thread": thread_width(num_threads), "level": 1, "is_origin": 1, "ray": range(PACKET_RAYS)}
    return {
        "write": data.StructLayout({"valid": 1, "own": 1, **vector, "vector": vector_layout(fmt)}),
        "step_address": data.StructLayout({"valid": 1, "thread": thread_width(num_threads), "level": 1, "axis": Axis}),
        "step_rays": data.ArrayLayout(data.StructLayout({"origin": fmt, "direction": fmt}), PACKET_RAYS),
        "vector_address": data.StructLayout({"valid": 1, **vector}),
        "vector": vector_layout(fmt),
    }


class RayStore(wiring.Component):
    """Holds origin and direction of each ray of each thread, in the scene's and in the instance's space.

    A kd-step needs one coordinate of four rays, the transformation three coordinates of one ray. Each gets a
    memory of its own; both are written together. The one for kd-steps takes a vector in three cycles, an axis
    a cycle, in a bank for each ray's origin and for each ray's direction: writers must leave three cycles from
    one vector to the next for the same bank. That they do is asserted in simulation.

    A packet's rays have one origin, kept as that of ray 0, or each has its own.

    Parameters
    ----------
    fmt : :class:`~fpu.FloatFormat`
        Format of coordinates.
    num_threads : int
        Threads.

    Members
    -------
    write : ``{"valid", "own", "thread", "level", "is_origin", "ray", "vector"}``, one vector of one packet, an origin
        of all its rays or of one ``own``; steps can read it ``write_latency`` cycles later
    step_address : ``{"valid", "thread", "level", "axis"}``; two cycles later
    step_rays : array of ``{"origin", "direction"}``: the coordinate of each ray
    vector_address : ``{"valid", "thread", "level", "is_origin", "ray"}``; two cycles later
    vector : the coordinates of the one vector
    """

    read_latency = 2
    write_latency = 4

    def __init__(self, *, fmt, num_threads):
        self._fmt = fmt
        self._num_threads = num_threads
        ports = ray_store_ports(fmt=fmt, num_threads=num_threads)
        super().__init__({
            "write": In(ports["write"]),
            "step_address": In(ports["step_address"]),
            "step_rays": Out(ports["step_rays"]),
            "vector_address": In(ports["vector_address"]),
            "vector": Out(ports["vector"]),
        })

    def _bank(self, m, name, *, select, field):
        """One coordinate memory; takes a vector when ``select`` is set."""
        thread_bits = thread_width(self._num_threads)
        m.submodules[name] = bank = BlockMemory(self._fmt, depth=1 << thread_bits + 3)
        axis = Signal(Axis, name=f"{name}_axis", init=Axis.LEAF)
        held = Signal(data.StructLayout({"level": 1, "thread": range(1 << thread_bits)}), name=f"{name}_held",
                      reset_less=True)
        vector = Signal(vector_layout(self._fmt), name=f"{name}_vector", reset_less=True)
        m.d.comb += [
            bank.write.valid.eq(axis != Axis.LEAF),
            bank.write.address.eq(Cat(axis, held.level, held.thread)),
            bank.write.data.eq(vector.x),
            bank.reading.eq(self.step_address.valid),
            bank.address.eq(Cat(self.step_address.axis, self.step_address.level, self.step_address.thread)),
            field.eq(bank.data),
        ]
        m.d.sync += [
            vector.x.eq(vector.y),
            vector.y.eq(vector.z),
        ]
        with m.Switch(axis):
            with m.Case(Axis.X):
                m.d.sync += axis.eq(Axis.Y)
            with m.Case(Axis.Y):
                m.d.sync += axis.eq(Axis.Z)
            with m.Case(Axis.Z):
                m.d.sync += axis.eq(Axis.LEAF)
        m.d.sync += Assert(~select | (axis == Axis.LEAF) | (axis == Axis.Z), "a vector comes before the last one is in")
        with m.If(select):
            m.d.sync += [
                axis.eq(Axis.X),
                held.level.eq(self.write.level),
                held.thread.eq(self.write.thread),
                vector.eq(self.write.vector),
            ]

    def elaborate(self, platform):
        m = Module()
        for ray in range(PACKET_RAYS):
            take_origin = Signal(name=f"take_origin{ray}")
            m.d.comb += take_origin.eq(self.write.valid & self.write.is_origin
                                       & (~self.write.own | (self.write.ray == ray)))
            self._bank(m, f"origin{ray}", select=take_origin, field=self.step_rays[ray].origin)
            take_direction = Signal(name=f"take_direction{ray}")
            m.d.comb += take_direction.eq(self.write.valid & ~self.write.is_origin & (self.write.ray == ray))
            self._bank(m, f"direction{ray}", select=take_direction, field=self.step_rays[ray].direction)

        def address(of):
            return Cat(of.ray, of.is_origin, of.level, of.thread)

        depth = 1 << len(address(self.vector_address))
        m.submodules.vectors = vectors = BlockMemory(vector_layout(self._fmt), depth=depth)
        m.d.comb += [
            vectors.write.valid.eq(self.write.valid),
            vectors.write.address.eq(address(self.write)),
            vectors.write.data.eq(self.write.vector),
            vectors.reading.eq(self.vector_address.valid),
            vectors.address.eq(address(self.vector_address)),
            self.vector.eq(vectors.data),
        ]
        return m
