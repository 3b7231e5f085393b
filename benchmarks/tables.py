"""Tables of docs/benchmarks.md, from the figures that benchmarks write."""

from __future__ import annotations

from typing import Any

from benchmarks.table import measured_on, row_of

_PLATES = {
    "obstacles": "obstacles of triangles, the upper one moved as the free plate",
    "scripted bodies": "rigid bodies, moved in the same way",
    "free bodies": "rigid bodies, the lower one held, the upper one free",
}
_WAYS = {
    "headless": "`simulate`, no page",
    "engine": "in the live page's simulation process, snapshots read at 60 Hz",
    "page": "the same, with the page served and a websocket that receives everything",
}


def rigid_bodies_text(figures: dict[str, Any]) -> str:
    """The table of `benchmarks.rigid_bodies`."""
    lines = [
        f"The ball has {figures['tets']:,} tets. {measured_on(figures)}",
        "",
        "| solver | plates | ms/step | Newton iterations or substeps | ratio |",
        "|---|---|---|---|---|",
    ]
    for solver, plates in figures["solvers"].items():
        for kind, text in _PLATES.items():
            one = plates[kind]
            ratio = one["ms_per_step"] / plates["obstacles"]["ms_per_step"]
            lines.append(f"| `{solver}` | {text} | {one['ms_per_step']:.1f} | {one['iterations']:.1f} | {ratio:.2f} |")
    return "\n".join(lines)


def live_text(figures: dict[str, Any]) -> str:
    """The table of `benchmarks.live`."""
    lines = [
        f"{figures['frames']} frames without pauses of {figures['tets']:,} tets, {figures['rounds']} alternating "
        f"rounds. {measured_on(figures)}",
        "",
        "| | ms/frame, best | median | ratio |",
        "|---|---|---|---|",
    ]
    for way, text in _WAYS.items():
        one = figures["ways"][way]
        lines.append(f"| {text} | {one['best']:.1f} | {one['median']:.1f} | {one['ratio']:.2f} |")
    lines += ["", f"In real time, with the page served, it ran at {figures['real_time']:.3f} of real time."]
    return "\n".join(lines)


def reading_text(figures: dict[str, Any]) -> str:
    """The sentences of `benchmarks.reading_fields`."""
    slowest = sorted(figures["fields"], key=figures["fields"].__getitem__, reverse=True)[:3]
    parts = ", ".join(f"`{name}` {figures['fields'][name]:.1f} ms" for name in slowest)
    rates = " and ".join(
        f"{one['frames_a_second']:.0f} frames a second at E = {1e-3 * one['youngs']:g} kPa ({one['substeps']} substeps)"
        for one in figures["live"]
    )
    return "\n".join(
        [
            f"Reading all fields of the tables takes {figures['ms_of_reading']:.1f} ms of processor time on one thread "
            f"for a finger of {figures['tets']:,} tets",
            f"with cavity and cable in `XPBD`: {100.0 * figures['share']:.0f} % of a step, which takes "
            f"{figures['ms_per_step']:.0f} ms with {figures['substeps']:.0f} substeps. Most of it: {parts}.",
            f"Without reading, threads={figures['threads_live']} ({figures['layer'] or 'one thread'}) simulates "
            f"{rates}",
            "(frames of 1/60 s, wall time): the number of substeps grows with the root of the modulus.",
            measured_on(figures),
        ]
    )


def speed_text(beam: dict[str, Any], projections: dict[str, Any]) -> str:
    """The sentence of README.md about speed, from `benchmarks.hanging_beam` and `benchmarks.projections`."""
    ours = row_of(beam, "Supple XPBD, 20 substeps")
    newton = row_of(beam, "Newton XPBD, 20 substeps x 1 iteration")
    mujoco = row_of(beam, "MuJoCo flex, explicit, 1 ms")
    column = list(projections["columns"]).index("1 / C")
    ratios = [row[column] for row in projections["rows"]]
    return (
        f"On one thread, a beam of {ours['tets']:,} tets takes {ours['ms/frame']:.1f} ms of the processor a frame (20 "
        f"substeps):\n{newton['ratio']:.1f} times as fast as Newton's XPBD and {mujoco['ratio']:.1f} times as fast as "
        f"MuJoCo's flex in the same run; constraint projections\nrun at {min(ratios):.1f} to {max(ratios):.1f} times "
        "plain C ([how it was measured](docs/benchmarks.md))."
    )
