"""Caches on one memory port: each gets the words of its own lines, in the order in which it has asked."""

import random
from collections import deque

import pytest

from rtl.line_sharing import LineSharing
from tests.bench import drain, feed, simulate, steady, until

LINE_WIDTH = 6


def word_of(line, place):
    return (line * 2654435761 + place * 40503) & 0xFFFFFFFF


@pytest.mark.parametrize(("seed", "num_users", "num_fetches", "line_words", "gap", "latency"), [
    (0, 2, 1, 1, 0.0, 1), (1, 2, 4, 4, 0.5, 20), (2, 3, 2, 3, 0.0, 9), (3, 4, 4, 9, 0.2, 3),
    (4, 4, 4, 1, 0.6, 1)])
def test_words_come_back_to_whoever_asked(seed, num_users, num_fetches, line_words, gap, latency):
    rng = random.Random(seed)
    dut = LineSharing(num_users=num_users, num_fetches=num_fetches, line_width=LINE_WIDTH, line_words=line_words)
    num_lines = 60
    left = [num_lines] * num_users
    requests = [deque() for _ in range(num_users)]
    expected = [deque() for _ in range(num_users)]
    owed = deque()
    num_words = [0] * num_users

    def receive(user):
        def take(word):
            line, place = expected[user].popleft()
            assert word == word_of(line, place), "a word of another line"
            num_words[user] += 1
        return take

    async def ask(ctx):
        """A cache asks for so many lines at a time as it may, and then waits for words."""
        while True:
            for user in range(num_users):
                under_way = -(-len(expected[user]) // line_words)
                if left[user] and under_way < num_fetches and rng.random() >= gap:
                    line = rng.randrange(1 << LINE_WIDTH)
                    requests[user].append(line)
                    expected[user].extend((line, place) for place in range(line_words))
                    left[user] -= 1
            await ctx.tick()

    async def answer(ctx):
        now = 0
        while True:
            ctx.set(dut.line_data.valid, 0)
            if owed and owed[0][0] <= now:
                _, line = owed.popleft()
                for place in range(line_words):
                    while rng.random() < gap:
                        await ctx.tick()
                        now += 1
                    ctx.set(dut.line_data.payload, word_of(line, place))
                    ctx.set(dut.line_data.valid, 1)
                    await ctx.tick()
                    now += 1
                    ctx.set(dut.line_data.valid, 0)
            else:
                await ctx.tick()
                now += 1
            clock[0] = now

    clock = [0]
    simulate(dut, until(lambda: not any((*left, *expected)), quiet=20), name="line_sharing", background=(
        answer, ask, steady(dut.line_request),
        drain(dut.line_request, lambda line: owed.append((clock[0] + latency, line)), rng=rng, gap=gap),
        *(feed(port, queue, rng=rng, gap=gap) for port, queue in zip(dut.request, requests, strict=True)),
        *(drain(port, receive(user)) for user, port in enumerate(dut.data))))
    assert not owed
    assert num_words == [num_lines * line_words] * num_users


def test_all_take_turns():
    dut = LineSharing(num_users=3, num_fetches=4, line_width=LINE_WIDTH, line_words=2)
    taken = []

    async def ask(ctx):
        ctx.set(dut.line_request.ready, 1)
        for user, request in enumerate(dut.request):
            ctx.set(request.payload, user)
            ctx.set(request.valid, 1)
        for _ in range(12):
            _, _, valid, line = await ctx.tick().sample(dut.line_request.valid, dut.line_request.payload)
            assert valid
            taken.append(line)

    simulate(dut, ask, name="line_sharing")
    assert taken == [0, 1, 2] * 4
