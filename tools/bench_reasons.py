"""Why a row takes more cycles than the paper's, by what was counted."""

from sim.scene.table3 import SIZE

__all__ = ["reasons", "textured_reasons"]

_UNITS = (("traversal", "kd-steps", "steps_per_ray"), ("list", "list entries", "entries_per_ray"),
          ("transformation", "transformations", "transformations_per_ray"),
          ("intersection", "triangle tests", "tests_per_ray"))
#: Part of the cycles from which a unit is what a picture waits for.
_BOUND = 0.9
#: How many times as much work is said to be more.
_MORE = 1.05


def _sentence(row):
    paper_cycles, busy = row["paper_cycles_per_ray"], list(row["busy"].values())
    work = [(unit, what, row[column], row["paper"]["busy"][number] / 100 * paper_cycles)
            for number, (unit, what, column) in enumerate(_UNITS)]
    more = [f"{ours / theirs:.1f} times the {what} ({ours:.1f} for {theirs:.1f})"
            for _, what, ours, theirs in work if ours > _MORE * theirs]
    busiest = max(range(len(_UNITS)), key=lambda number: busy[number])
    unit, what, ours, theirs = work[busiest]
    text = (f"{row['scene']}, {row['size'][0]}×{row['size'][1]}: {row['cycles_per_ray']:.1f} cycles a ray for "
            f"{paper_cycles:.1f}, {row['cycles_ratio']:.2f} times as many. Our scene and view take "
            f"{', '.join(more) or 'no more work of any unit'}.")
    part, paper_part = busy[busiest], row["paper"]["busy"][busiest] / 100
    bound = "is what it waits for" if part >= _BOUND else "is busiest"
    text += f" The unit of {unit} {bound}, {100 * part:.0f} % of the cycles (paper {100 * paper_part:.0f} %)"
    if ours > theirs:
        text += (f"; at the paper's {what} a ray and our part of cycles, it would be "
                 f"{theirs / ours * row['cycles_per_ray']:.1f} cycles a ray")
    if part < min(paper_part, _BOUND) or ours <= theirs:
        waits = ", ".join(f"{name} {100 * part:.0f} % (paper {paper})" for (name, part), paper in
                          zip(list(row["hit"].items())[:3], row["paper"]["hit"], strict=True))
        text += f". What is left is waiting for memory: hits of {waits}"
    return f"{text}."


def reasons(rows):
    """A sentence for each row of the paper's chip that takes more cycles a ray than the paper.

    The paper does not say how much work a ray is, but how busy each unit is: a step, a list entry, a transformation
    and a test each take their unit a cycle, so that part of the paper's cycles a ray is the work it had.
    """
    return [_sentence(row) for row in rows if row["chip"] == "paper" and row["shading"] == "simple"
            and (row["cycles_ratio"] or 0) > 1]


def textured_reasons(rows):
    """A sentence for each row with textures that takes more cycles a ray than the paper, by what textures add."""
    simple = {row["scene"]: row for row in rows if _is(row, "simple")}
    return [_textured(row, simple[row["scene"]]) for row in rows
            if _is(row, "textured") and row["scene"] in simple and (row["cycles_ratio"] or 0) > 1]


def _is(row, shading):
    return (row["chip"], row["shading"], tuple(row["size"])) == ("paper", shading, SIZE)


def _textured(row, simple):
    unit, part = max(row["busy"].items(), key=lambda unit: unit[1])
    more = row["transformations_per_ray"] - simple["transformations_per_ray"]
    return (f"{row['scene']}: {row['cycles_per_ray']:.1f} cycles a ray for {row['paper_cycles_per_ray']:.1f}. Without "
            f"textures it is {simple['cycles_per_ray']:.1f}; the shader's program of "
            f"{row['instructions_per_ray']:.0f} instructions a ray adds "
            f"{row['cycles_per_ray'] - simple['cycles_per_ray']:.1f}, and {more:.1f} transformations to "
            f"{simple['transformations_per_ray']:.1f}. No unit is what it waits for: {unit} is busiest, "
            f"{100 * part:.0f} %. What is left are latencies: of memory, as {100 * row['hit']['textures']:.0f} % of "
            "the texels' lines hit, and of instructions, of which a ray has one under way at a time.")
