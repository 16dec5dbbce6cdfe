"""Tables of docs/accuracy.md from results."""

from sim.stability.cases import CASES

from .page import markdown_table

__all__ = ["PARTS", "SHOWN", "rates"]

#: Methods whose limits and plots are shown.
SHOWN = ("printed", "firm edges", "default", "Woop 2013")


def rates(results):
    """Failures over rays of all values of a case, by case and method."""
    sums = {}
    for row in results["rows"]:
        of = sums.setdefault(row["case"], {}).setdefault(row["method"], [0, 0])
        of[0] += row["failures"]
        of[1] += row["rays"]
    return {case: {method: failures / max(number, 1) for method, (failures, number) in methods.items()}
            for case, methods in sums.items()}


def _percent(rate):
    if rate == 0:
        return "0"
    return f"{100 * rate:.2g} %" if rate < 0.1 else f"{100 * rate:.0f} %"


def _methods(results):
    rows = []
    for row in results.get("methods", []):
        cost, once = row["cost"], row["per_ray"]
        rows.append([row["method"], *(cost.get(kind) or "–" for kind in ("add", "mul", "dot", "div", "cmp")),
                     ", ".join(f"{number} {kind}" for kind, number in once.items() if number) or "–",
                     f"{row['luts']:,}" if row["luts"] else "–"])
    return markdown_table(["method", "add", "mul", "dot", "div", "cmp", "once a ray", "LUT of the operators"], rows)


def _rates(results):
    found = rates(results)
    names = list(dict.fromkeys(row["method"] for row in results["rows"]))
    return markdown_table(["case", *names],
                          [[case, *(_percent(of[name]) if name in of else "" for name in names)]
                           for case, of in found.items()])


def _between(limit):
    if limit is None:
        return "none"
    low, high = limit
    return f"{low:g}" if low == high else f"{low:g} … {high:g}"


def _ranges(results, kind, methods=SHOWN):
    rows = []
    for name, of in results.get(kind, {}).items():
        case = CASES[name]
        rows.append([name, case.parameter, _between((case.values[0], case.values[-1])),
                     *(_between(of[method]) if method in of else "" for method in methods)])
    return markdown_table(["case", "parameter", "tried", *methods], rows)


def _limits(results):
    return _ranges(results, "limits")


def _bounds(results):
    return _ranges(results, "bounds")


def _kinds(results):
    sums = {}
    for row in results["rows"]:
        if row["method"] in SHOWN:
            of = sums.setdefault((row["case"], row["method"]), [0] * 5)
            for place, kind in enumerate(("rays", "cracks", "phantoms", "distances", "odd")):
                of[place] += row[kind]
    return markdown_table(["case", "method", "rays", "cracks", "phantoms", "distance", "odd"],
                          [[*names, *(f"{number:,}" for number in numbers)] for names, numbers in sums.items()
                           if any(numbers[1:])])


PARTS = {"methods": _methods, "rates": _rates, "limits": _limits, "bounds": _bounds, "kinds": _kinds}
