"""The list of entities in a map: what stands where, as pairs of key and value."""

import math
import re

from .error import SceneError

__all__ = ["numbers", "parse_entities"]

_TOKEN = re.compile(r'([{}])|"([^"]*)"|(\S)')
_SHOWN = 20


def parse_entities(text, place):
    """List of entities, each a dict of its keys (of equal ones the last counts).

    Parameters
    ----------
    text : str
        ``{ "key" "value" … } …``
    place : str
        What messages call it.

    Raises
    ------
    SceneError
        For anything else.
    """
    entities, words = [], None
    for match in _TOKEN.finditer(text):
        brace, word, other = match.groups()
        if other or (brace == "{") != (words is None):
            shown = text[match.start():match.start() + _SHOWN]
            raise SceneError(f"{place}: entity {len(entities)}: '{shown}' is not understood")
        if brace == "{":
            words = []
        elif brace == "}":
            if len(words) % 2:
                raise SceneError(f"{place}: entity {len(entities)}: key '{words[-1]}' has no value")
            entities.append(dict(zip(words[::2], words[1::2], strict=True)))
            words = None
        else:
            words.append(word)
    if words is not None:
        raise SceneError(f"{place}: entity {len(entities)}: has no '}}'")
    return entities


def numbers(entity, key, default, place):
    """The numbers that an entity has at a key, as many as ``default`` has, which is for entities without it.

    Raises
    ------
    SceneError
        If they are not so many finite numbers.
    """
    if key not in entity:
        return default
    try:
        values = tuple(float(word) for word in entity[key].split())
    except ValueError:
        values = ()
    if len(values) != len(default) or not all(map(math.isfinite, values)):
        raise SceneError(f"{place}: entity '{entity.get('classname', '')}': '{key}' must be {len(default)} finite "
                         f"number{'s' if len(default) > 1 else ''}, not '{entity[key][:_SHOWN]}'")
    return values
