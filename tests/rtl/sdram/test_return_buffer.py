"""Words that come back in any order leave as whole lines, in the order in which they were asked for."""

import random
from collections import deque

import pytest

from rtl.sdram.return_buffer import ReturnBuffer
from tests.bench import drain, simulate, until


@pytest.mark.parametrize(("seed", "words", "slots"), [
    (0, [4], [4]), (1, [9, 9], [4, 4]), (2, [1, 4, 9, 16, 2], [4, 4, 2, 8, 1]), (3, [1], [8])])
def test_lines_are_whole_and_in_order(seed, words, slots):
    rng = random.Random(seed)
    dut = ReturnBuffer(words=words, slots=slots)
    num_lines = 40
    expected = [deque() for _ in words]
    asked, pieces = [0] * len(words), []
    # Per port, whether the second piece of its line is still to be asked for
    second = [None] * len(words)
    slot_width = max((max(slots) - 1).bit_length(), 1)

    async def traffic(ctx):
        while min(asked) < num_lines or any(expected) or pieces:
            # A word in every second cycle at most, of whichever piece that has been asked for before
            if pieces and rng.random() < 0.6:
                number = rng.randrange(len(pieces))
                tag, place, value, last = pieces[number].popleft()
                ctx.set(dut.answer, {"valid": 1, "word": value, "place": place, "tag": tag, "last": last})
                if not pieces[number]:
                    del pieces[number]
            port = rng.randrange(len(words))
            slot = ctx.get(dut.slot[port])

            def ask(is_second, split, place, count):
                ctx.set(dut.asked[port], {"valid": 1, "second": is_second, "split": split})
                tag = is_second | slot << 1 | port << 1 + slot_width
                values = [rng.getrandbits(32) for _ in range(count)]
                expected[port].extend(values)
                pieces.append(deque((tag, place + word, value, word == count - 1) for word, value in enumerate(values)))

            if second[port] is not None:
                place = second[port]
                ask(1, 1, place, words[port] - place)
                second[port], asked[port] = None, asked[port] + 1
            elif asked[port] < num_lines and ctx.get(dut.has_slot[port]) and rng.random() < 0.7:
                split = words[port] > 1 and rng.random() < 0.5
                count = rng.randint(1, words[port] - 1) if split else words[port]
                ask(0, split, 0, count)
                second[port], asked[port] = (count, asked[port]) if split else (None, asked[port] + 1)
            await ctx.tick()
            for port in range(len(words)):
                ctx.set(dut.asked[port].valid, 0)
            ctx.set(dut.answer.valid, 0)
            await ctx.tick()

    def receive(port):
        def take(word):
            assert word == expected[port].popleft(), f"port {port}"
        return take

    simulate(dut, traffic, until(lambda: min(asked) == num_lines and not any(expected) and not pieces, quiet=10),
             name="return_buffer", ticks=50_000,
             background=[drain(port, receive(number)) for number, port in enumerate(dut.data)])
