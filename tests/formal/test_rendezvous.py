"""The rendezvous loses no ray and doubles none, and a packet starts once its last ray has stopped, after the latency.

Where each ray is is kept account of. When rays stop and how, when packets are traced, and who waits, is free; that no
ray is made up, and that offers stand until they are taken, is assumed.
"""

import pytest
from amaranth.hdl import Assert, Assume, Cat, Module, Mux, Signal, Value
from amaranth.lib import data, enum

from fpu import FloatFormat
from rtl.layout import PACKET_RAYS
from rtl.microcode import Op, Program
from rtl.rendezvous import Rendezvous
from tests.formal.prove import Refuted, prove

NUM_THREADS = 2


class Place(enum.Enum, shape=3):
    """Where a ray is."""

    NOWHERE = 0
    RUNNING = 1
    #: It has stopped to be traced, others of its packet have not.
    WAITING = 2
    TRACED = 3
    ENDED = 4


def rendezvous_proof(*, broken=False):
    m = Module()
    m.submodules.rendezvous = dut = Rendezvous(
        fmt=FloatFormat(2, 1), num_threads=NUM_THREADS, stack_depth=1, index_width=1,
        program=Program(({"op": Op.EMIT},) * 2, ()), ray_stack_depth=1)
    free = []
    inputs = (dut.begin.payload, dut.begin.valid, dut.stop.payload, dut.stop.valid, dut.packet.payload,
              dut.packet.valid, dut.limit.ready, dut.ray.ready, dut.may_end)
    for target in map(Value.cast, inputs):
        free.append(Signal(len(target), name=f"free{len(free)}"))
        m.d.comb += target.eq(free[-1])
    for number, port in enumerate((dut.begin, dut.packet)):
        waits, last = Signal(name=f"waits{number}"), Signal.like(Value.cast(port.payload), name=f"last{number}")
        m.d.sync += [waits.eq(port.valid & ~port.ready), last.eq(port.payload)]
        m.d.comb += Assume(~waits | port.valid & (last == Value.cast(port.payload)))

    begins, stops, comes_back = Signal(), Signal(), Signal()
    m.d.comb += [begins.eq(dut.begin.valid & dut.begin.ready), stops.eq(dut.stop.valid & dut.stop.ready),
                 comes_back.eq(dut.ray.valid & dut.ray.ready), Assume(dut.begin.payload.mask.any())]
    stop, ray = dut.stop.payload, dut.ray.payload
    for thread in range(NUM_THREADS):
        places = [Signal(Place, name=f"place{thread}_{number}") for number in range(PACKET_RAYS)]
        after = [Signal(Place, name=f"after{thread}_{number}") for number in range(PACKET_RAYS)]
        is_traced = Signal(name=f"is_traced{thread}")
        stopping = stops & (stop.token.thread == thread)
        starting = dut.start.valid & (dut.start.payload.thread == thread)
        finishing = dut.finished.valid & (dut.finished.payload.thread == thread)
        packet_here = dut.packet.valid & (dut.packet.payload.thread == thread)
        m.d.comb += [
            Assume(~(dut.begin.valid & (dut.begin.payload.thread == thread))
                   | Cat(place == Place.NOWHERE for place in places).all()),
            Assume(~packet_here | is_traced),
        ]
        going_on = Signal(name=f"going_on{thread}")
        waiting = Cat(place == Place.WAITING for place in places)
        has_stopped = Signal(Rendezvous.latency + 1, name=f"has_stopped{thread}")
        m.d.sync += has_stopped[1:].eq(has_stopped[:-1])
        m.d.comb += [
            going_on.eq(Cat((place == Place.RUNNING) | (place == Place.TRACED) for place in after).any()),
            has_stopped[0].eq(stopping & ~going_on),
            Assert(starting + finishing == has_stopped[-1]),
            Assert(~starting | (dut.start.payload.mask == waiting)),
            Assert(~starting | dut.start.payload.mask.any()),
            Assert(~finishing | ~waiting.any()),
        ]
        with m.If(starting):
            m.d.sync += is_traced.eq(1)
        with m.Elif(packet_here & dut.packet.ready):
            m.d.sync += is_traced.eq(0)
        here = Signal(PACKET_RAYS, name=f"here{thread}")
        m.d.comb += here.eq(Cat(place == Place.TRACED for place in places))
        # What has been taken of a packet comes at once: nothing stays behind.
        m.d.comb += Assert(is_traced | (here == Mux(dut.ray.valid & (ray.thread == thread), 1 << ray.ray, 0)))
        for number, (place, then) in enumerate(zip(places, after, strict=True)):
            kept = Signal(data.StructLayout({"counter": 1, "sp": 1}), name=f"kept{thread}_{number}")
            stops_here = stopping & (stop.token.ray == number)
            m.d.comb += [
                Assume(~dut.stop.valid | (stop.token.thread != thread) | (stop.token.ray != number)
                       | (place == Place.RUNNING)),
                then.eq(place),
            ]
            with m.If(stops_here):
                m.d.comb += then.eq(Mux(stop.is_trace, Place.WAITING, Place.ENDED))
                m.d.sync += [kept.counter.eq(stop.token.counter), kept.sp.eq(stop.token.sp ^ broken)]
            m.d.sync += place.eq(then)
            with m.If(starting & (place == Place.WAITING)):
                m.d.sync += place.eq(Place.TRACED)
            with m.If(finishing):
                m.d.sync += place.eq(Place.NOWHERE)
            with m.If(begins & (dut.begin.payload.thread == thread) & dut.begin.payload.mask[number]):
                m.d.sync += place.eq(Place.RUNNING)
            with m.If(dut.ray.valid & (ray.thread == thread) & (ray.ray == number)):
                m.d.comb += Assert((place == Place.TRACED) & (ray.counter == kept.counter) & (ray.sp == kept.sp))
                with m.If(comes_back):
                    m.d.sync += place.eq(Place.RUNNING)
    return m, free


def test_no_ray_is_lost_or_doubled(tmp_path):
    module, ports = rendezvous_proof()
    prove(module, ports=ports, cycles=10, by_induction=False, folder=tmp_path)


def test_a_wrong_claim_is_refuted(tmp_path):
    module, ports = rendezvous_proof(broken=True)
    with pytest.raises(Refuted, match="model found"):
        prove(module, ports=ports, cycles=8, by_induction=False, folder=tmp_path)
