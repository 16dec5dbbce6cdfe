"""Tokens as dictionaries, with random fields."""

from rtl.layout import PACKET_RAYS, IntervalSource

__all__ = ["fields", "random_mask", "random_token", "rays_of"]


def random_mask(rng):
    return rng.randrange(1, 1 << PACKET_RAYS)


def rays_of(mask):
    """Numbers of the rays in a mask."""
    return [ray for ray in range(PACKET_RAYS) if mask >> ray & 1]


def random_token(rng, *, thread, stack_depth, **known):
    token = {
        "thread": thread, "level": rng.randrange(2), "hit": rng.randrange(1 << PACKET_RAYS),
        "mask": random_mask(rng), "sp": rng.randrange(stack_depth + 1), "interval": rng.choice(list(IntervalSource)),
    }
    return token | known


def fields(token):
    """A sampled token as a dictionary."""
    return {name: token[name] for name, _ in token.shape()}
