"""The page that shows first light's figures."""

__all__ = ["page"]

_INTRODUCTION = """\
# First light

Real scenes, drawn by the cycle-accurate simulated chip: one DynRTC, {size} pixels, primary rays, format {fmt},
{threads} threads, and the paper's memory: 32-bit SRAM banks, here {latency} cycles from a request to its first word.
Every figure on this page stands in [`results/first_light.json`](results/first_light.json), and both are written by

    make first-light SCENES=../shared/scenes

(`dynrt first-light --help` tells more; with `--clone` it times the README's commands). A single picture is, for
example,

    dynrt render ../shared/scenes/conference/conference.obj --report report.json \\
        --camera 9.144,6.4008,2.1336,8.9121,6.2133,2.0706,0,0,1,60

The views are the first ones of `cameras.json`; the paper's are not known, nor are its models the same, so its figures
stand beside ours for orientation. Caches: {nodes} nodes, {lists} list entries, {matrices} matrices, {kilobytes:.1f} KB
(paper: 12 KB). Chip: `{chip}`.
"""


def _table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def _with_paper(ours, paper):
    return ours if paper is None else f"{ours} ({paper})"


def _percent(fractions, paper):
    return _with_paper(" / ".join(f"{100 * fraction:.0f}" for fraction in fractions),
                       paper and " / ".join(map(str, paper)))


def page(results):
    """The text of ``docs/first-light.md``."""
    chip = results["chip"]
    rows = results["rows"]
    nodes = chip["node_lines"] * chip["node_line_items"]
    lists = chip["list_lines"] * chip["list_line_items"]
    exp_width, frac_width = map(int, chip["fmt"].split("."))
    matrix_bytes = 4 * -(-12 * (1 + exp_width + frac_width) // 32)
    parts = [_INTRODUCTION.format(
        size="×".join(map(str, results["size"])), fmt=chip["fmt"], threads=chip["num_threads"], latency=4,
        nodes=nodes, lists=lists, matrices=chip["matrix_lines"],
        kilobytes=(8 * nodes + 4 * lists + matrix_bytes * chip["matrix_lines"]) / 1024,
        chip=", ".join(f"{name}={value}" for name, value in chip.items()))]

    parts.append("## Speed\n\nIn parentheses the paper's Table 3 and 4; its shading reads bilinear textures, ours a "
                 "word a ray yet. Simulated cycles a second are of one core.\n")
    parts.append(_table(
        ["scene", "paper's row", "triangles", "objects", "cycles a ray", "busy %: traversal / list / transformation / "
         "intersection", "hit %: nodes / lists / matrices", "bytes a ray: DynRTC + shading", "simulated kHz"],
        [[row["scene"], row.get("paper", {}).get("row", "–"), f"{row['triangles']:,}", f"{row['instances']:,}",
          _with_paper(f"{row['cycles_per_ray']:.2f}", row.get("paper", {}).get("cycles_per_ray")),
          _percent(row["busy"].values(), row.get("paper", {}).get("busy_percent")),
          _percent(row["hit"].values(), row.get("paper", {}).get("hit_percent")),
          _with_paper(
              f"{sum(n for memory, n in row['bytes_per_ray'].items() if memory != 'shading'):.1f} + "
              f"{row['bytes_per_ray']['shading']:.1f}",
              " + ".join(f"{number:.1f}" for number in row["paper"]["bytes_per_ray"]) if "paper" in row else None),
          f"{row['simulated_hz'] / 1e3:.0f}"] for row in rows]))
    parts.append("What a ray costs, counted by the model. A scene in which nothing moves and no mesh is there twice is "
                 "put into one space, so that no ray is transformed into an instance. A packet of four rays takes a "
                 "kd-step a clock, so at most one of the first two columns times four, whichever is larger, bounds "
                 "the cycles of a packet from below.\n")
    parts.append(_table(
        ["scene", "kd-steps + leaves (packets)", "transformed vectors", "triangle tests", "list entries (packets)",
         "instances entered (packets)", "stack entries", "one space"],
        [[row["scene"], f"{row['per_ray']['steps']:.2f} + {row['per_ray']['leaves']:.2f}",
          f"{row['per_ray']['transformed_vectors']:.2f}", f"{row['per_ray']['triangle_tests']:.2f}",
          f"{row['per_ray']['entries']:.2f}", f"{row['per_ray']['instances']:.2f}", str(row["stack_entries"]),
          "yes" if row["flattened"] else "no"] for row in rows]))

    parts.append("## Right\n\nPixels of the frame that differ: rtl from the model in anything (instance, triangle, "
                 "t, u, v, colour); rtl from golden (float64) in the triangle; golden from Embree (float32) in the "
                 "distance, by more than 10⁻⁴.\n")
    pixels = results["size"][0] * results["size"][1]
    parts.append(_table(
        ["scene", "rtl ≠ model", "other triangle than golden", "PSNR against golden", "golden ≠ Embree"],
        [[row["scene"], str(row["wrong_pixels_vs_model"]),
          f"{row['wrong_pixels_vs_golden']} ({100 * row['wrong_pixels_vs_golden'] / pixels:.3f} %)",
          f"{row['psnr_vs_golden']:.1f} dB", str(row["golden_pixels_vs_embree"])] for row in rows]))
    checked = [row for row in rows if row["checks"]]
    if checked:
        threads = sorted({run["threads"] for run in checked[0]["checks"]})
        seeds = sorted({run["seed"] for run in checked[0]["checks"]})
        size = "×".join(map(str, results["check_size"]))
        parts.append(f"The same at {size} pixels with {', '.join(map(str, threads))} threads, "
                     f"each under {len(seeds)} seeds of random memory latencies (up to {results['jitter']} "
                     "cycles more, random pauses and refusals; a receiver of pixels that pauses): pixels in which rtl "
                     "differs from the model, over all runs of a scene, and cycles for the first seed.\n")
        parts.append(_table(
            ["scene", "runs", "pixels that differ", *(f"cycles, {number} threads" for number in threads)],
            [[row["scene"], str(len(row["checks"])), str(sum(run["wrong_pixels_vs_model"] for run in row["checks"])),
              *(f"{next(run['cycles'] for run in row['checks'] if run['threads'] == number):,}"
                for number in threads)] for row in checked]))

    parts.append("## Time\n")
    parts.append(_table(
        ["scene", "kd-trees and matrices, s", "model, 512×384, s"],
        [[row["scene"], f"{row['seconds']['build_trees']:.1f}", f"{row['seconds']['model']:.1f}"] for row in rows]))
    clone = results.get("fresh_clone_seconds")
    if clone:
        parts.append("The README's commands in a fresh clone, with a new virtual environment and empty caches, on "
                     "two cores: " + ", ".join(f"`{command}` {seconds:.0f} s" for command, seconds in clone.items())
                     + ".\n")

    parts.append("## Pictures\n\nBy the chip; brightness is |D′z|, the free dot product of the intersection.\n")
    parts += [f"![{row['scene']}](pictures/first-light-{row['scene']}.png)\n" for row in rows]
    parts.append("Conference room © Anat Grynberg and Greg Ward; simple room by Greg Ward; bunny from the Stanford "
                 "3D Scanning Repository; grande salle © LAAS-CNRS/ONERA; terrain from frozen_river by Jasmin Patry, "
                 "bush © Scopia Visual Interfaces Systems" + ("; oa_dm5 © OpenArena Team." if any(
                     row["scene"] == "quake3-oa_dm5" for row in rows) else ".") + "\n")
    return "\n".join(parts)
