"""Texture lookups: four texels about a place, decoded and weighted."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from fpu import Delay
from fpu.product import Product
from fpu.rom import Rom

from .block_memory import BlockMemory
from .cache import WORD_WIDTH, Cache
from .color_unit import byte_fraction
from .queue import Queue
from .srgb import COLOR_ONE, linear_colors
from .texel_address import PLACE_WIDTH, WEIGHT_BITS, TexelAddress, TexturePlace, texture_members

__all__ = ["Texture"]

_FACTOR_WIDTH = COLOR_ONE.bit_length()
_BASE_WIDTH = 24
# As many as the smallest memory of tables holds, and more than are under way when all are answered at once.
_NUM_LOOKUPS = 16


class _Blend(wiring.Component):
    """Weighted sums of decoded texels; one texel a clock.

    Members
    -------
    texel : red, green, blue, opacity, a byte each
    first : the texel is the first of its sum
    corner, f, g : it is on the right by bit 0 of ``corner``, below by bit 1; weights of those that are, in 1/256
    sums : of the four channels, in 2^-32, half a unit of 2^-16 more; ``latency`` cycles after the last texel
    """

    latency = 4

    def __init__(self):
        super().__init__({
            "texel": In(WORD_WIDTH), "first": In(1), "corner": In(2), "f": In(WEIGHT_BITS), "g": In(WEIGHT_BITS),
            "sums": Out(data.ArrayLayout(_FACTOR_WIDTH + 2 * WEIGHT_BITS, 4)),
        })

    def elaborate(self, platform):
        m = Module()
        decoding = 2
        m.submodules.weight = weight = Product(WEIGHT_BITS + 1, WEIGHT_BITS + 1, cycles=1)
        m.submodules.first = first = Delay(1, cycles=decoding + 1)
        m.d.comb += first.i.eq(self.first)
        for axis, share, factor in ((0, self.f, weight.a), (1, self.g, weight.b)):
            along = Signal(WEIGHT_BITS + 1, name=f"along{axis}", reset_less=True)
            m.d.sync += along.eq(Mux(self.corner[axis], share, (1 << WEIGHT_BITS) - share))
            m.d.comb += factor.eq(along)
        for channel, total in enumerate(self.sums):
            byte = self.texel[8 * channel:8 * channel + 8]
            if channel < 3:
                m.submodules[f"linear{channel}"] = linear = Rom(linear_colors(), width=_FACTOR_WIDTH, cycles=decoding)
                m.d.comb += linear.address.eq(byte)
                value = linear.data
            else:
                m.submodules.opacity = opacity = Delay(_FACTOR_WIDTH, cycles=decoding)
                m.d.comb += opacity.i.eq(byte_fraction(byte))
                value = opacity.o
            m.submodules[f"product{channel}"] = product = Product(_FACTOR_WIDTH, _FACTOR_WIDTH, cycles=1)
            accumulator = Signal(len(total), name=f"accumulator{channel}", reset_less=True)
            half = 1 << 2 * WEIGHT_BITS - 1
            m.d.comb += [product.a.eq(weight.p), product.b.eq(value), total.eq(accumulator)]
            m.d.sync += accumulator.eq(Mux(first.o, half, accumulator) + product.p)
        return m


class Texture(wiring.Component):
    """Looks up colours and opacities at texture coordinates (docs/shading.md, 8 and 9): one in about four cycles.

    Filtered, with places and corners of :class:`~rtl.texel_address.TexelAddress`, f = (p − 128) & 255 and g likewise,
    each channel is (Σ wₖcₖ + 2^15) >> 16 of weights (256 − f)(256 − g), f(256 − g), (256 − f)g, fg and colours cₖ:
    linear_colors() of the texel's byte, of opacity rint(2^16 n / 255). Unfiltered it is that of the one texel.

    A request takes the next of ``num_slots`` places for texels, which come from the cache in any order; the one whose
    turn it is is weighted when all of its texels are there. So answers are in the order of requests. A request keeps
    its slot until its answer has left, so no queue behind it can overflow, and nothing there waits for a receiver.

    Parameters
    ----------
    fmt : :class:`~fpu.FloatFormat`
        Format of coordinates.
    payload_shape : :ref:`shape-like <lang-shapelike>`
        What travels with a request and comes back with its answer.
    num_slots : int
        Requests in flight, a power of two from 2 on; about 8 keep the unit busy when all texels are in the cache.
    num_lines, line_items, num_fetches, index_width : int
        Of the cache of texels, see :class:`~rtl.cache.Cache`; lines of 4 are blocks of 2×2 texels.

    Members
    -------
    request : stream of ``{"s", "t", "base", "log2_width", "log2_height", "filtered", "folded", "payload"}``: where on
        which texture; ``base`` is the number of its first texel in memory, a multiple of 4
    response : stream of ``{"color", "opacity", "payload"}``, in units of 2^-16
    line_request, line_data, flush, flushed, hit, miss : see :class:`~rtl.cache.Cache`

    Raises
    ------
    ValueError
        If a number that must be a power of two is not.
    """

    def __init__(self, *, fmt, payload_shape, num_slots=16, num_lines=128, line_items=4, num_fetches=4,
                 index_width=_BASE_WIDTH):
        self._fmt = fmt
        self._payload_shape = payload_shape
        self._num_slots = num_slots
        self._slot_width = exact_log2(num_slots)
        if not self._slot_width:
            raise ValueError("a texture unit has at least 2 slots, not 1")
        self._index_width = index_width
        self._cache = dict(num_lines=num_lines, line_items=line_items, num_fetches=num_fetches)
        super().__init__({
            "request": In(stream.Signature(data.StructLayout({
                "s": fmt, "t": fmt, **texture_members(base_width=_BASE_WIDTH), "payload": payload_shape}))),
            "response": Out(stream.Signature(data.StructLayout({
                "color": data.ArrayLayout(_FACTOR_WIDTH, 3), "opacity": _FACTOR_WIDTH, "payload": payload_shape}))),
            "line_request": Out(stream.Signature(index_width - exact_log2(line_items))),
            "line_data": In(stream.Signature(WORD_WIDTH, always_ready=True)),
            "flush": In(1),
            "flushed": Out(1),
            "hit": Out(1),
            "miss": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        depth, slot_width = self._num_slots, self._slot_width
        # Of all requests in flight, in order: what comes back, the textures, the places, and the weights.
        m.submodules.payloads = payloads = Queue(self._payload_shape, depth=depth, always_ready=True)
        m.submodules.textures = textures = Queue(
            data.StructLayout(texture_members(base_width=self._index_width)), depth=depth, always_ready=True)
        m.submodules.places = places = Queue(
            data.StructLayout({"x": PLACE_WIDTH, "y": PLACE_WIDTH}), depth=depth, always_ready=True)
        m.submodules.weights = weights = Queue(
            data.StructLayout({"f": WEIGHT_BITS, "g": WEIGHT_BITS, "filtered": 1}), depth=depth, always_ready=True)
        m.submodules.colors = colors = Queue(data.ArrayLayout(_FACTOR_WIDTH, 4), depth=depth, always_ready=True)

        # Two cycles for each request, one a coordinate.
        request = self.request.payload
        m.submodules.place = place = TexturePlace(fmt=self._fmt)
        under_way = Signal(range(depth + 1))
        takes, is_second, accepts, leaves, left = Signal(), Signal(), Signal(), Signal(), Signal()
        is_there = Signal(place.latency)
        x = Signal(PLACE_WIDTH, reset_less=True)
        m.d.comb += [
            takes.eq(self.request.valid & (under_way < depth)),
            accepts.eq(takes & is_second),
            self.request.ready.eq(accepts),
            leaves.eq(self.response.valid & self.response.ready),
            place.coordinate.eq(Mux(is_second, request.t.as_value(), request.s.as_value())),
            place.log2_side.eq(Mux(is_second, request.log2_height, request.log2_width)),
            place.folded.eq(request.folded),
            payloads.i.payload.eq(request.payload),
            payloads.i.valid.eq(accepts),
            [textures.i.payload[name].eq(request[name]) for name in texture_members(base_width=self._index_width)],
            textures.i.valid.eq(accepts),
            places.i.payload.x.eq(x),
            places.i.payload.y.eq(place.place),
            places.i.valid.eq(is_there[-1]),
        ]
        m.d.sync += [
            left.eq(leaves),
            under_way.eq(under_way + accepts - left),
            is_there.eq(Cat(accepts, is_there)),
            x.eq(place.place),
        ]
        with m.If(takes):
            m.d.sync += is_second.eq(~is_second)

        # One cycle for each corner, while the lookups without an answer have room to wait before the cache, and in it.
        ticket = data.StructLayout({"corner": 2, "slot": slot_width, "filtered": 1})
        m.submodules.lookups = lookups = Queue(
            data.StructLayout({"index": self._index_width, "payload": ticket}), depth=_NUM_LOOKUPS, always_ready=True)
        m.submodules.cache = cache = Cache(
            item_width=WORD_WIDTH, payload_shape=ticket, index_width=self._index_width, num_waiting=_NUM_LOOKUPS,
            **self._cache)
        m.submodules.address = address = TexelAddress(index_width=self._index_width)
        m.submodules.tickets = tickets = Delay(ticket, cycles=address.latency)
        unanswered = Signal(range(_NUM_LOOKUPS + 1))
        corner, slot = Signal(2), Signal(slot_width)
        looks_up, is_last_corner = Signal(), Signal()
        is_found = Signal(address.latency)
        texture = textures.o.payload
        m.d.comb += [
            looks_up.eq(places.o.valid & (unanswered < _NUM_LOOKUPS)),
            is_last_corner.eq(~texture.filtered | corner.all()),
            places.o.ready.eq(looks_up & is_last_corner),
            textures.o.ready.eq(looks_up & is_last_corner),
            weights.i.payload.filtered.eq(texture.filtered),
            weights.i.valid.eq(looks_up & (corner == 0)),
            address.x.eq(places.o.payload.x),
            address.y.eq(places.o.payload.y),
            address.corner.eq(corner),
            address.texture.eq(texture),
            tickets.i.corner.eq(corner),
            tickets.i.slot.eq(slot),
            tickets.i.filtered.eq(texture.filtered),
            lookups.i.payload.index.eq(address.index),
            lookups.i.payload.payload.eq(tickets.o),
            lookups.i.valid.eq(is_found[-1]),
        ]
        for weight, along in ((weights.i.payload.f, places.o.payload.x), (weights.i.payload.g, places.o.payload.y)):
            m.d.comb += weight.eq(Mux(texture.filtered, along[:WEIGHT_BITS] ^ 1 << WEIGHT_BITS - 1, 0))
        m.d.sync += [
            unanswered.eq(unanswered + looks_up - cache.response.valid),
            is_found.eq(Cat(looks_up, is_found)),
        ]
        with m.If(looks_up):
            m.d.sync += [corner.eq(Mux(is_last_corner, 0, corner + 1)), slot.eq(slot + is_last_corner)]

        wiring.connect(m, lookups.o, cache.request)
        wiring.connect(m, cache.line_request, wiring.flipped(self.line_request))
        wiring.connect(m, wiring.flipped(self.line_data), cache.line_data)
        m.d.comb += [cache.flush.eq(self.flush), self.flushed.eq(cache.flushed), self.hit.eq(cache.hit),
                     self.miss.eq(cache.miss)]

        # Counts of texels that have come go round, so they begin anew by themselves.
        m.submodules.texels = texels = BlockMemory(WORD_WIDTH, depth=4 * depth)
        counts = Signal(data.ArrayLayout(2, depth))
        complete = Signal(depth)
        found = cache.response.payload.payload
        m.d.comb += [
            cache.response.ready.eq(1),
            texels.write.valid.eq(cache.response.valid),
            texels.write.address.eq(Cat(found.corner, found.slot)),
            texels.write.data.eq(cache.response.payload.item),
        ]
        with m.If(cache.response.valid & found.filtered):
            m.d.sync += counts[found.slot].eq(counts[found.slot] + 1)
        with m.If(cache.response.valid & (~found.filtered | counts[found.slot].all())):
            m.d.sync += complete.bit_select(found.slot, 1).eq(1)

        # One cycle for each texel, of the oldest request.
        reading = texels.latency
        m.submodules.blend = blend = _Blend()
        oldest, texel = Signal(slot_width), Signal(2)
        weighs, is_last_texel = Signal(), Signal()
        is_summed = Signal(reading + blend.latency)
        m.submodules.beside = beside = Delay(
            data.StructLayout({"first": 1, "corner": 2, "f": WEIGHT_BITS, "g": WEIGHT_BITS}), cycles=reading)
        m.d.comb += [
            weighs.eq(complete.bit_select(oldest, 1)),
            is_last_texel.eq(~weights.o.payload.filtered | texel.all()),
            weights.o.ready.eq(weighs & is_last_texel),
            texels.reading.eq(weighs),
            texels.address.eq(Cat(texel, oldest)),
            beside.i.first.eq(texel == 0),
            beside.i.corner.eq(texel),
            beside.i.f.eq(weights.o.payload.f),
            beside.i.g.eq(weights.o.payload.g),
            blend.texel.eq(texels.data),
            [getattr(blend, name).eq(beside.o[name]) for name in ("first", "corner", "f", "g")],
            [color.eq(total[2 * WEIGHT_BITS:]) for color, total in zip(colors.i.payload, blend.sums, strict=True)],
            colors.i.valid.eq(is_summed[-1]),
        ]
        m.d.sync += [
            is_summed.eq(Cat(weighs & is_last_texel, is_summed)),
        ]
        with m.If(weighs):
            m.d.sync += texel.eq(Mux(is_last_texel, 0, texel + 1))
            with m.If(is_last_texel):
                m.d.sync += [complete.bit_select(oldest, 1).eq(0), oldest.eq(oldest + 1)]

        m.d.comb += [
            [color.eq(result) for color, result in zip(self.response.payload.color, colors.o.payload, strict=False)],
            self.response.payload.opacity.eq(colors.o.payload[3]),
            self.response.payload.payload.eq(payloads.o.payload),
            self.response.valid.eq(colors.o.valid),
            colors.o.ready.eq(self.response.ready),
            payloads.o.ready.eq(leaves),
        ]
        return m
