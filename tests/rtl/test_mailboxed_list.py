"""The mailboxed list against walks in Python, with answers that come back in any order."""

import random
from collections import Counter, OrderedDict, deque

import pytest

from rtl.layout import PACKET_RAYS
from rtl.mailboxed_list import MailboxedList
from tests.bench import drain, feed, simulate, until
from tests.rtl.packets import fields, random_token

STACK_DEPTH, INDEX_WIDTH = 4, 8
INSTANCES = range(200, 204)


class Mailbox:
    """The last few numbers and the rays that have been tested against each."""

    def __init__(self, num_entries):
        self.num_entries = num_entries
        self.letters = OrderedDict()

    def untested(self, index, mask):
        tested = self.letters.get(index, 0)
        if self.num_entries:
            if index not in self.letters and len(self.letters) == self.num_entries:
                self.letters.popitem(last=False)
            self.letters[index] = tested | mask
        return mask & ~tested


class Packet:
    """A packet's way: leaves at random, in the scene and in the instances that it enters, and what is to happen."""

    def __init__(self, world, thread):
        self.world, self.thread = world, thread
        self.mailboxes = [Mailbox(world.mailbox_entries) for _ in range(2)]
        self.num_leaves = [world.rng.randrange(1, 5), 0]
        self.hit = 0
        self.walks = [None, None]
        self.expected = None

    def enter_leaf(self, level):
        """The next leaf of that level, as a place, or None."""
        rng, lists = self.world.rng, self.world.lists[level]
        if not self.num_leaves[level]:
            return None
        self.num_leaves[level] -= 1
        begin = rng.choice(list(lists))
        token = random_token(rng, thread=self.thread, stack_depth=STACK_DEPTH, level=level, hit=self.hit)
        self.walks[level] = self.walk(token, lists[begin])
        self.expected = next(self.walks[level])
        return {"token": token, "list": begin}

    def walk(self, token, entries):
        """What comes out: a job (token, index, is it an instance) or, as the last thing, a token to pop."""
        for index in entries:
            is_instance = index in INSTANCES
            wanted = self.mailboxes[token["level"]].untested(index, token["mask"])
            if wanted:
                if is_instance:
                    self.mailboxes[1] = Mailbox(self.world.mailbox_entries)
                yield token | {"mask": wanted, "hit": self.hit}, index, is_instance
            else:
                self.world.events["skipped"] += 1
        yield token | {"hit": self.hit}

    def go_on(self, level):
        self.expected = next(self.walks[level])


class World:
    """Lists in memory, and the rest of the chip round the unit."""

    def __init__(self, *, seed, num_threads, num_packets, mailbox_entries, gap):
        self.rng = rng = random.Random(seed)
        self.num_packets, self.mailbox_entries, self.gap = num_packets, mailbox_entries, gap
        self.events = Counter()
        self.items = {}
        # Few triangles, so that they come again, and some just after being forgotten.
        self.lists = [self.make_lists([*range(5), *INSTANCES], 0), self.make_lists(range(5, 11), 100)]
        self.packets = {}
        self.idle = set(range(num_threads))
        self.leaves, self.tested, self.left = deque(), deque(), deque()
        self.fetched, self.entries = [], deque()
        self.waiting = []
        self.rng_streams = random.Random(rng.random())

    def make_lists(self, indices, place):
        lists = {}
        for _ in range(12):
            entries = [self.rng.choice(indices) for _ in range(self.rng.randrange(1, 7))]
            lists[place] = entries
            for index in entries:
                self.items[place] = (index in INSTANCES) << 30 | index
                place += 1
            self.items[place - 1] |= 1 << 31
        return lists

    @property
    def finished(self):
        return not self.num_packets and not self.packets

    def fetch(self, request):
        """What the list cache is asked, to be answered in any order."""
        assert request.index == request.payload.list
        self.fetched.append((self.items[request.index], request.payload))

    def job(self, job):
        packet = self.packets[job.token.thread]
        assert (fields(job.token), job.index, bool(job.instance)) == packet.expected
        self.events["instance" if job.instance else "job"] += 1
        if job.instance:
            packet.num_leaves[1] = self.rng.randrange(4)
            self.go_down(packet)
        else:
            packet.hit |= self.rng.randrange(1 << PACKET_RAYS)
            # Nothing else of the token counts.
            self.answer(self.tested, packet, level=job.token.level)

    def answer(self, port, packet, *, level):
        self.waiting.append((port, packet, level))

    def go_down(self, packet):
        place = packet.enter_leaf(1)
        if place is None:
            self.answer(self.left, packet, level=0)
        else:
            self.leaves.append(place)

    def pop(self, token):
        packet = self.packets[token.thread]
        assert fields(token) == packet.expected
        self.events["pop"] += 1
        if token.level:
            self.go_down(packet)
            return
        place = packet.enter_leaf(0)
        if place is None:
            del self.packets[token.thread]
            self.idle.add(token.thread)
        else:
            self.leaves.append(place)


def run(world, *, num_threads):
    dut = MailboxedList(num_threads=num_threads, stack_depth=STACK_DEPTH, index_width=INDEX_WIDTH,
                        mailbox_entries=world.mailbox_entries)
    rng = world.rng_streams

    async def rest_of_the_chip(ctx):
        begun = []
        while True:
            ctx.set(dut.begin.valid, 0)
            # The way to a first leaf is long.
            for _, packet in filter(lambda item: not item[0], begun):
                world.leaves.append(packet.enter_leaf(0))
            begun = [(cycles - 1, packet) for cycles, packet in begun if cycles]
            if world.idle and world.num_packets and rng.random() < 0.2:
                thread = rng.choice(sorted(world.idle))
                world.idle.remove(thread)
                world.num_packets -= 1
                packet = world.packets[thread] = Packet(world, thread)
                ctx.set(dut.begin, {"valid": 1, "thread": thread})
                begun.append((5, packet))
            if world.waiting and rng.random() < 0.5:
                port, packet, level = world.waiting.pop(rng.randrange(len(world.waiting)))
                port.append(random_token(rng, thread=packet.thread, stack_depth=STACK_DEPTH, level=level,
                                         hit=packet.hit))
                packet.go_on(level)
            if world.fetched and rng.random() < 0.6:
                item, payload = world.fetched.pop(rng.randrange(len(world.fetched)))
                world.entries.append({"item": item, "payload": {"token": fields(payload.token), "list": payload.list}})
            await ctx.tick()

    async def count_busy(ctx):
        async for _, _, busy in ctx.tick().sample(dut.busy):
            world.events["busy"] += busy

    def source(port, queue):
        return feed(port, queue, rng=rng, gap=world.gap)

    ticks = 1000 * world.num_packets // num_threads + 1000
    simulate(dut, until(lambda: world.finished, quiet=10), ticks=ticks, name="mailboxed_list",
             background=(rest_of_the_chip, count_busy, source(dut.leaf, world.leaves), source(dut.tested, world.tested),
                         source(dut.left, world.left), source(dut.entry, world.entries),
                         drain(dut.fetch, world.fetch, rng=rng, gap=world.gap), drain(dut.job, world.job),
                         drain(dut.pop, world.pop)))
    assert not any((world.leaves, world.tested, world.left, world.fetched, world.entries, world.waiting))
    assert world.events["busy"] == sum(world.events[event] for event in ("job", "instance", "skipped"))
    return world.events


@pytest.mark.parametrize(("seed", "num_threads", "mailbox_entries", "gap"), [
    (0, 1, 4, 0.0), (1, 5, 1, 0.3), (2, 8, 2, 0.0), (3, 16, 3, 0.5)])
def test_walks(seed, num_threads, mailbox_entries, gap):
    world = World(seed=seed, num_threads=num_threads, num_packets=12 + 3 * num_threads,
                  mailbox_entries=mailbox_entries, gap=gap)
    events = run(world, num_threads=num_threads)
    assert min(events[event] for event in ("job", "instance", "skipped", "pop")) > 20


def test_without_a_mailbox_nothing_is_skipped():
    events = run(World(seed=5, num_threads=4, num_packets=20, mailbox_entries=0, gap=0.1), num_threads=4)
    assert events["job"] > 20
    assert not events["skipped"]


def test_an_entry_a_cycle():
    """Leaves whose entries have all been tested: as fast as the cache answers, and the lists end."""
    threads = 16
    dut = MailboxedList(num_threads=threads, stack_depth=STACK_DEPTH, index_width=INDEX_WIDTH, mailbox_entries=2)
    rng = random.Random(0)
    # Each packet finds its triangle in two leaves.
    entries = deque({"item": 1 << 31 | 3, "payload": {"token": {"thread": thread, "mask": 0b0110}, "list": 9}}
                    for _ in range(2) for thread in range(threads))
    jobs, pops = [], []
    simulate(dut, until(lambda: len(pops) == threads), ticks=2 * threads + 10, name="mailboxed_list", background=(
        feed(dut.entry, entries, rng=rng), drain(dut.job, jobs.append), drain(dut.pop, pops.append)))
    assert [(job.token.thread, job.index, job.token.mask) for job in jobs] == [(k, 3, 0b0110) for k in range(threads)]
    assert [pop.thread for pop in pops] == list(range(threads))


def test_a_job_follows_its_entry_4_cycles_later():
    dut = MailboxedList(num_threads=1, stack_depth=1, index_width=INDEX_WIDTH, mailbox_entries=1)

    async def offer(ctx):
        ctx.set(dut.entry.payload, {"item": 7, "payload": {"token": {"mask": 1}}})
        ctx.set(dut.entry.valid, 1)
        for is_there in (0, 0, 0, 0, 1, 0):
            assert ctx.get(dut.job.valid) == is_there
            await ctx.tick()
            ctx.set(dut.entry.valid, 0)

    simulate(dut, offer, name="mailboxed_list")
