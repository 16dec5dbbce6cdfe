"""Intersection of rays with the unit triangle, and the closest hit of each ray."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from fpu import Delay

from . import soft_hits
from .arithmetic import ARITHMETICS
from .block_memory import BlockMemory
from .layout import PACKET_RAYS, scale_layout, thread_width, token_layout, vector_layout, with_token
from .queue import Queue
from .unit_triangle import MARGIN, unit_triangle

__all__ = ["Intersection", "hit_layout", "limits_layout", "unit_triangle"]


def hit_layout(*, fmt, index_width):
    """A ray's hit: where on which triangle of which instance, and D′z, the cosine of §2.1.3."""
    return data.StructLayout({
        "t": fmt, "u": fmt, "v": fmt, "cosine": fmt,
        "triangle": index_width, "instance": index_width, "in_instance": 1,
    })


def limits_layout(*, fmt, index_width):
    """What a ray may hit: beyond ``t_near`` any but one triangle; for ``any_hit`` no more once it is a solid one.

    ``instance`` is all ones for a triangle outside of all instances.
    """
    return data.StructLayout({"t_near": fmt, "triangle": index_width, "instance": index_width, "any_hit": 1})


class Intersection(wiring.Component):
    """Tests a ray against the unit triangle each clock, and keeps each ray's closest hit.

    A hit at the same distance as an earlier one does not replace it. A ray for which any hit will do has its distance
    set to 0 by a solid triangle, so that nothing is nearer from then on. With a tolerance it is keys that are compared
    and kept for the stack, and beside each ray's the soft hits that wait for another, see
    :func:`~rtl.unit_triangle.unit_triangle`; while a ray has no more than that, its record is that of a hit of triangle
    number all ones, its key ∞.

    Parameters
    ----------
    fmt : :class:`~fpu.FloatFormat`
        Format of coordinates.
    num_threads, stack_depth, index_width : int
        See :class:`~rtl.config.ChipConfig`.
    latencies : dict
        Of the operators, see :class:`~fpu.Datapath`.
    arithmetic : :class:`~rtl.arithmetic.Arithmetic`
        How it computes.
    limited : bool
        Whether rays have limits.
    num_readers : int
        Records that can be read at a time.
    near : bool
        Whether t_near is one of them; if not, it counts as 0.
    tolerance : int
        Of edges, in units in the last place; 0 for none.

    Members
    -------
    vector : stream of ``{"token", "index", "is_origin", "ray", "first", "last", "solid", "vector", "scale"}``: rays in
        the triangle's space, an origin before the directions that begin there
    limit : stream of ``{"thread", "ray", "has_far", "t_far", "limits"}``: a ray that begins; if it has a ``t_far``, its
        record is that of a hit there of triangle number all ones (if ``limited``)
    entered : ``{"valid", "thread", "index"}``: the packet's next hits belong to that instance
    tested : stream of tokens: a packet's rays are through, and its token knows which have a hit
    hit_address, hit_distances : a thread; two cycles later, of each ray's hit what the next has to be nearer than
    record_address, record : for each reader, a thread and a ray; two cycles later, its hit
    busy : a ray is taken in
    """

    def __init__(self, *, fmt, num_threads, stack_depth, index_width, latencies=None,
                 arithmetic=ARITHMETICS[0], limited=False, near=False, num_readers=1, tolerance=0):
        self._tolerance = tolerance
        self._num_readers = num_readers
        self._fmt = fmt
        self._near = near
        self._limited = limited
        self._latencies = latencies
        self._arithmetic = arithmetic
        self._num_threads = num_threads
        self._index_width = index_width
        self._token = token = token_layout(num_threads=num_threads, stack_depth=stack_depth)
        self._record = hit_layout(fmt=fmt, index_width=index_width)
        self._limits = limits_layout(fmt=fmt, index_width=index_width)
        begin = data.StructLayout({"thread": thread_width(num_threads), "ray": range(PACKET_RAYS), "has_far": 1,
                                   "t_far": fmt, "limits": self._limits})
        super().__init__({
            **({"limit": In(stream.Signature(begin))} if limited else {}),
            "vector": In(stream.Signature(with_token(
                token, index=index_width, is_origin=1, ray=range(PACKET_RAYS), first=1, last=1,
                solid=int(limited), vector=vector_layout(fmt), scale=scale_layout(fmt, is_there=tolerance > 0)),
                always_ready=True)),
            "entered": In(data.StructLayout({"valid": 1, "thread": thread_width(num_threads), "index": index_width})),
            "tested": Out(stream.Signature(token, always_ready=True)),
            "hit_address": In(thread_width(num_threads)),
            "hit_distances": Out(data.ArrayLayout(fmt, PACKET_RAYS)),
            "record_address": In(data.StructLayout({"ray": range(PACKET_RAYS), "thread": thread_width(num_threads)})
                                 ).array(num_readers),
            "record": Out(self._record).array(num_readers),
            "busy": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        num_slots = 1 << thread_width(self._num_threads)
        graph = unit_triangle(self._fmt, latencies=self._latencies, arithmetic=self._arithmetic,
                              near=self._near, tolerant=self._tolerance > 0)
        m.submodules.test = test = graph.component()

        vector = self.vector.payload
        origin = Signal(vector_layout(self._fmt), reset_less=True)
        taken = Signal()
        with m.If(self.vector.valid & vector.is_origin):
            m.d.sync += origin.eq(vector.vector)
        m.d.comb += [taken.eq(self.vector.valid & ~vector.is_origin), self.busy.eq(taken)]
        for axis in "xyz":
            m.d.comb += [
                getattr(test, f"origin_{axis}").eq(getattr(origin, axis)),
                getattr(test, f"direction_{axis}").eq(getattr(vector.vector, axis)),
            ]
        if self._tolerance:
            self._scale(m, test, vector)

        # A cycle after the test it is decided whether the hit counts; the distance to beat has its address two cycles
        # before it is wanted.
        latency = graph.latency + 1
        beside_layout = data.StructLayout({"token": self._token, "ray": range(PACKET_RAYS), "first": 1, "last": 1,
                                           "index": self._index_width, "cosine": self._fmt,
                                           "solid": int(self._limited)})
        ask_at = graph.inputs["t_hit"].start - 2
        # Of each ray, what the next hit has to be nearer than.
        best_layout = self._fmt
        if self._tolerance:
            best_layout = soft_hits.best_layout(self._fmt)
        m.submodules.to_ask = to_ask = Delay(beside_layout, cycles=ask_at)
        m.submodules.to_end = to_end = Delay(beside_layout, cycles=latency - ask_at, registered=True)
        valid = Signal(latency + 1)
        m.d.comb += [
            to_ask.i.token.eq(vector.token),
            to_ask.i.ray.eq(vector.ray),
            to_ask.i.first.eq(vector.first),
            to_ask.i.last.eq(vector.last),
            to_ask.i.index.eq(vector.index),
            to_ask.i.cosine.eq(vector.vector.z),
            to_ask.i.solid.eq(vector.solid),
            to_end.i.eq(to_ask.o),
            valid[0].eq(taken),
        ]
        m.d.sync += valid[1:].eq(valid[:-1])
        m.submodules.distances = distances = BlockMemory(best_layout, depth=PACKET_RAYS * num_slots)
        best = distances.data
        if self._tolerance:
            best = soft_hits.stored_best(m, test, best, to_ask.o, fmt=self._fmt)
        m.d.comb += [
            distances.reading.eq(valid[ask_at]),
            distances.address.eq(Cat(to_ask.o.ray, to_ask.o.token.thread)),
            test.t_hit.eq(best.key if self._tolerance else best),
        ]

        about_soft = {"key": self._fmt, "is_soft": 1, "is_loose": 1} if self._tolerance else {}
        found = Signal(data.StructLayout({"hit": 1, "nearer": 1, "t": self._fmt, "u": self._fmt, "v": self._fmt,
                                          **about_soft}), reset_less=True)
        m.d.sync += [found[name].eq(getattr(test, name)) for name in found.shape().members]
        done = to_end.o
        before = Signal(PACKET_RAYS)
        now = Signal(PACKET_RAYS)
        hits_so_far = Signal(PACKET_RAYS, reset_less=True)
        tested, is_tested = Signal(self._token, reset_less=True), Signal()
        better = Signal()
        kept = Signal() if self._tolerance else better
        allowed, is_over = Signal(init=1), Signal()
        m.d.comb += [
            better.eq(valid[-1] & found.hit & allowed & (found.nearer | ~done.token.hit.bit_select(done.ray, 1))),
            before.eq(Mux(done.first, done.token.hit, hits_so_far)),
            now.eq(before | (kept << done.ray)),
            self.tested.payload.eq(tested),
            self.tested.valid.eq(is_tested),
        ]
        m.d.sync += [tested.eq(done.token), tested.hit.eq(now), is_tested.eq(valid[-1] & done.last)]
        with m.If(valid[-1]):
            m.d.sync += hits_so_far.eq(now)

        m.submodules.instances = instances = memory.Memory(shape=self._index_width, depth=num_slots, init=[])
        entered_write, instance_read = instances.write_port(), instances.read_port(domain="comb")
        # What is written to the distances: a hit's, or the one that a ray begins with. A record has its t.
        t = Signal(self._fmt)
        m.d.comb += t.eq(Mux(is_over, self._fmt.const(0.0), found.t))
        new_best = Signal(best_layout) if self._tolerance else t
        # What is written is known late in a cycle, and goes in the next.
        place = data.StructLayout({"ray": range(PACKET_RAYS), "thread": done.token.thread.shape()})
        found_write = data.StructLayout({"place": place, "best": best_layout, "record": self._record})
        kept_hit = Signal(found_write, reset_less=True)
        has_kept, record_is_kept = Signal(), Signal()
        record_write = Signal(data.StructLayout({"en": 1, "data": self._record}))
        m.d.sync += [
            has_kept.eq(kept),
            record_is_kept.eq(record_write.en),
            kept_hit.place.ray.eq(done.ray),
            kept_hit.place.thread.eq(done.token.thread),
            kept_hit.best.eq(new_best),
            kept_hit.record.eq(record_write.data),
        ]
        written = Signal(found_write)
        is_written, record_is_written = Signal(), Signal()
        m.d.comb += [
            written.eq(kept_hit),
            is_written.eq(has_kept),
            record_is_written.eq(record_is_kept),
            entered_write.addr.eq(self.entered.thread),
            entered_write.data.eq(self.entered.index),
            entered_write.en.eq(self.entered.valid),
            instance_read.addr.eq(done.token.thread),
            distances.write.valid.eq(is_written),
            distances.write.address.eq(written.place),
            distances.write.data.eq(written.best),
            record_write.data.t.eq(t),
            record_write.data.u.eq(found.u),
            record_write.data.v.eq(found.v),
            record_write.data.cosine.eq(done.cosine),
            record_write.data.triangle.eq(done.index),
            record_write.data.instance.eq(instance_read.data),
            record_write.data.in_instance.eq(done.token.level),
            record_write.en.eq(kept),
        ]
        for number in range(self._num_readers):
            m.submodules[f"records{number}"] = records = BlockMemory(self._record, depth=PACKET_RAYS * num_slots)
            m.d.comb += [
                records.write.valid.eq(record_is_written),
                records.write.address.eq(written.place),
                records.write.data.eq(written.record),
                records.address.eq(self.record_address[number]),
                self.record[number].eq(records.data),
            ]

        # A second copy of the distances, a memory for each ray, for the stack, which wants all four at once.
        asked_at = Signal.like(self.hit_address, name="asked_at", reset_less=True)
        m.d.sync += asked_at.eq(self.hit_address)
        for ray in range(PACKET_RAYS):
            m.submodules[f"distances{ray}"] = bank = memory.Memory(shape=self._fmt, depth=num_slots, init=[])
            bank_read, bank_write = bank.read_port(domain="comb"), bank.write_port()
            bank_distance = Signal(self._fmt, name=f"distance{ray}", reset_less=True)
            m.d.comb += [
                bank_write.addr.eq(written.place.thread),
                bank_write.data.eq(written.best.key if self._tolerance else written.best),
                bank_write.en.eq(is_written & (written.place.ray == ray)),
                bank_read.addr.eq(asked_at),
                self.hit_distances[ray].eq(bank_distance),
            ]
            m.d.sync += bank_distance.eq(bank_read.data)
        if self._tolerance:
            soft_hits.keep_soft(m, best, new_best, record_write, fmt=self._fmt, found=found, done=done, better=better,
                                kept=kept, taken=valid[-1] & allowed, is_over=is_over,
                                cycles=latency - graph.inputs["t_hit"].start)
        if self._limited:
            # So that the shader does not wait within a cycle for whether there is a hit.
            m.submodules.begins = queue = Queue(self.limit.payload.shape(), depth=2)
            wiring.connect(m, wiring.flipped(self.limit), queue.i)
            begins, begin = queue.o, queue.o.payload
            with m.If(~has_kept):
                m.d.comb += [
                    is_written.eq(begins.valid & begin.has_far),
                    record_is_written.eq(is_written),
                    written.place.ray.eq(begin.ray),
                    written.place.thread.eq(begin.thread),
                    written.record.t.eq(begin.t_far),
                    written.record.triangle.eq(~0),
                ]
                if self._tolerance:
                    m.d.comb += soft_hits.begun(written.best, begin.t_far, fmt=self._fmt)
                else:
                    m.d.comb += written.best.eq(begin.t_far)
            m.d.comb += begins.ready.eq(~has_kept)
            self._limit(m, test, begins, to_ask.o, to_end.o, asks=valid[ask_at], cycles=latency - ask_at,
                        instances=instances, allowed=allowed, is_over=is_over)
        return m

    def _scale(self, m, test, vector):
        """How much rounding may have changed origin and direction goes beside them."""
        fmt = self._fmt
        origin_scale = Signal(vector.scale.shape(), reset_less=True)
        with m.If(self.vector.valid & vector.is_origin):
            m.d.sync += origin_scale.eq(vector.scale)
        for name, scale in (("origin", origin_scale), ("direction", vector.scale)):
            for number, axis in enumerate("xyz"):
                m.d.comb += getattr(test, f"{name}_scale_{axis}").exp.eq(scale[number])
        m.d.comb += [test.tolerance.eq(fmt.const(self._tolerance * 2.0**-fmt.frac_width)),
                     test.margin.eq(fmt.const(MARGIN * self._tolerance * 2.0**-fmt.frac_width))]

    def _limit(self, m, test, begins, asking, done, *, asks, cycles, instances, allowed, is_over):
        """Looks up the limits of the ray ``asking``, ``cycles`` before it is ``done``."""
        m.submodules.limits = limits = BlockMemory(self._limits, depth=PACKET_RAYS << thread_width(self._num_threads))
        instance_read = instances.read_port(domain="comb")
        limit = limits.data
        m.submodules.asked = asked = Delay(
            data.StructLayout({"triangle": self._index_width, "instance": self._index_width}), cycles=2)
        begin = begins.payload
        m.d.comb += [
            limits.reading.eq(asks),
            limits.address.eq(Cat(asking.ray, asking.token.thread)),
            limits.write.address.eq(Cat(begin.ray, begin.thread)),
            limits.write.data.eq(begin.limits),
            limits.write.valid.eq(begins.valid),
            instance_read.addr.eq(asking.token.thread),
            asked.i.triangle.eq(asking.index),
            asked.i.instance.eq(Mux(asking.token.level, instance_read.data, ~0)),
        ]
        if self._near:
            m.d.comb += test.t_near.eq(limit.t_near)
        m.submodules.verdict = verdict = Delay(data.StructLayout({"excluded": 1, "any_hit": 1}), cycles=cycles - 2,
                                               registered=True)
        m.d.comb += [
            verdict.i.excluded.eq((limit.triangle == asked.o.triangle) & (limit.instance == asked.o.instance)),
            verdict.i.any_hit.eq(limit.any_hit),
            allowed.eq(~verdict.o.excluded),
            is_over.eq(verdict.o.any_hit & done.solid),
        ]
