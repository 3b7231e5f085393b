"""Hanging beam in Supple. Prints one JSON line, with times of the processor.

usage: our_beam.py xpbd|xpbd_without_contact SCALE SUBSTEPS FRAMES [POSITIONS.npy]
       our_beam.py implicit|linearized SCALE STEP INTEGRATOR TOLERANCE FRAMES [POSITIONS.npy]
SCALE 1 -> 1,152 tets, 2 -> 9,216; frames are of 1/60 s, STEP in seconds; TOLERANCE 0 is the solver's own.
"""

from __future__ import annotations

import json
import sys
import time
from dataclasses import replace

import numpy as np

import supple as sp


def beam_scene(scale: int) -> sp.Scene:
    """1.2 x 0.4 x 0.4 m, mu = lam = 1e5 Pa, 1000 kg/m^3, held at x = 0."""
    mu = lam = 1e5
    youngs, poisson = mu * (3 * lam + 2 * mu) / (lam + mu), lam / 2 / (lam + mu)
    material = sp.StableNeoHookean(youngs=youngs, poisson=poisson, density=1e3)
    mesh = sp.shapes.box(size=(1.2, 0.4, 0.4), divisions=(12 * scale, 4 * scale, 4 * scale))
    low = mesh.vertices.min(axis=0)
    held = sp.Pin("beam", sp.InBox(low - 1e-9, (low[0] + 1e-9, 1e3, 1e3)))
    return sp.Scene(bodies=[sp.Body("beam", mesh, material)], pins=[held])


def peak_megabytes() -> float | None:
    """Peak memory of this process; None where the system does not report it (Windows)."""
    try:
        import resource
    except ImportError:
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1e6 if sys.platform == "darwin" else 1e3)


def main() -> None:
    kind, scale = sys.argv[1], int(sys.argv[2])
    if kind not in ("implicit", "linearized"):
        substeps, frames, *rest = sys.argv[3:]
        contact = {"xpbd": sp.XPBD().contact, "xpbd_without_contact": None}[kind]
        solver: sp.XPBD | sp.Implicit = sp.XPBD(substeps=int(substeps), contact=contact)
        dt = 1 / 60
    else:
        step, integrator, tolerance, frames, *rest = sys.argv[3:]
        solver = sp.Implicit(integrator=integrator, tolerance=float(tolerance) or None)
        if kind == "linearized":
            solver = replace(solver, max_iterations=1)
        dt = float(step)
    steps = round(int(frames) / 60 / dt)
    scene = beam_scene(scale)
    list(sp.simulate(scene, solver, dt=dt, steps=2))  # compiles, or loads the cache
    stepping = sp.simulate(scene, solver, dt=dt, steps=steps)
    frame, statuses, iterations = None, set(), 0
    start = time.process_time()
    for frame in stepping:
        statuses.add(str(frame.report.status))
        iterations += frame.report.iterations
    seconds = time.process_time() - start
    assert frame is not None
    x = frame.positions["beam"]
    if rest:
        np.save(rest[0], np.column_stack([scene.bodies[0].mesh.vertices, x]))
    print(
        json.dumps(
            {
                "tets": len(scene.bodies[0].mesh.tets),
                "ms_per_frame": 1e3 * seconds / int(frames),
                "ms_per_step": 1e3 * seconds / steps,
                "iterations_per_step": iterations / steps,
                "statuses": sorted(statuses),
                "peak_MB": peak_megabytes(),
                "finite": bool(np.isfinite(x).all()),
                "lowest": float(x[:, 1].min()),
            }
        )
    )


if __name__ == "__main__":
    main()
