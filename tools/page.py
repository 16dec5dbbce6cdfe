"""Tables in a page's prose, each between two comments."""

import re

from .errors import BadInput

__all__ = ["check_places", "filled_page", "markdown_table"]


def markdown_table(head, rows):
    """Lines of a table, or that there is nothing to show."""
    if not rows:
        return "Not measured.\n"
    lines = ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(map(str, row)) + " |" for row in rows]) + "\n"


def _between(name):
    return re.compile(rf"(?<=<!-- begin: {name} -->\n).*?(?=^<!-- end: {name} -->$)", re.DOTALL | re.MULTILINE)


def _check_place(page, name):
    """Sees that the table ``name`` has its place."""
    try:
        text = page.read_text()
    except OSError as error:
        raise BadInput(f"{page}: cannot be read: {error.strerror}") from error
    if len(_between(name).findall(text)) != 1:
        raise BadInput(f"{page}: must have the lines '<!-- begin: {name} -->' and '<!-- end: {name} -->' once, for "
                       "the table between them")


def check_places(page, names):
    """Sees that every table has its place in ``page``.

    Raises
    ------
    BadInput
        If there is no page, or a place is missing.
    """
    for name in names:
        _check_place(page, name)


def filled_page(page, parts, results):
    """Text of ``page`` with the table that each of ``parts``, a function by its name, makes of ``results``.

    Raises
    ------
    BadInput
        If there is no page, or a place is missing.
    """
    check_places(page, parts)
    text = page.read_text()
    for name, part in parts.items():
        table = f"\n{part(results)}\n"
        text = _between(name).sub(lambda match, table=table: table, text)
    return text
