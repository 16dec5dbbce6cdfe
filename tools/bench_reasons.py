"""Why a row takes more cycles than the paper's, by what was counted."""

__all__ = ["reasons"]

_UNITS = (("traversal", "kd-steps", "steps_per_ray"), ("list", "list entries", "entries_per_ray"),
          ("transformation", "transformations", "transformations_per_ray"),
          ("intersection", "triangle tests", "tests_per_ray"))
#: Part of the cycles from which a unit is what a picture waits for.
_BOUND = 0.9


def _sentence(row):
    paper_cycles, busy = row["paper_cycles_per_ray"], list(row["busy"].values())
    work = [(unit, what, row[column], row["paper"]["busy"][number] / 100 * paper_cycles)
            for number, (unit, what, column) in enumerate(_UNITS)]
    more = [f"{ours / theirs:.1f} times the {what} ({ours:.1f} for {theirs:.1f})"
            for _, what, ours, theirs in work if ours > theirs]
    busiest = max(range(len(_UNITS)), key=lambda number: busy[number])
    unit, what, ours, theirs = work[busiest]
    text = (f"{row['scene']}, {row['size'][0]}×{row['size'][1]}: {row['cycles_per_ray']:.1f} cycles a ray for "
            f"{paper_cycles:.1f}, {row['cycles_ratio']:.2f} times as many. Our scene and view take "
            f"{', '.join(more) or 'no more work of any unit'}.")
    part, paper_part = busy[busiest], row["paper"]["busy"][busiest] / 100
    bound = "is what it waits for" if part >= _BOUND else "is busiest"
    text += f" The unit of {unit} {bound}, {100 * part:.0f} % of the cycles (paper {100 * paper_part:.0f} %)"
    if ours > theirs:
        return text + (f"; at the paper's {what} a ray and our part of cycles, it would be "
                       f"{theirs / ours * row['cycles_per_ray']:.1f} cycles a ray.")
    waits = ", ".join(f"{name} {100 * part:.0f} % (paper {paper})" for (name, part), paper in
                      zip(list(row["hit"].items())[:3], row["paper"]["hit"], strict=True))
    return text + f"; what is left is waiting for memory: hits of {waits}."


def reasons(rows):
    """A sentence for each row of the paper's chip that takes more cycles a ray than the paper.

    The paper does not say how much work a ray is, but how busy each unit is: a step, a list entry, a transformation
    and a test each take their unit a cycle, so that part of the paper's cycles a ray is the work it had.
    """
    return [_sentence(row) for row in rows if row["chip"] == "paper" and row["shading"] == "simple"
            and (row["cycles_ratio"] or 0) > 1]
