"""Hanging beam in Supple. Prints one JSON line.

usage: our_beam.py xpbd SCALE SUBSTEPS FRAMES [POSITIONS.npy]     (SCALE 1 -> 1,152 tets, 2 -> 9,216)
"""

from __future__ import annotations

import json
import sys
import time

import numpy as np

import supple as sp


def beam_scene(scale: int) -> sp.Scene:
    """1.2 x 0.4 x 0.4 m, mu = lam = 1e5 Pa, 1000 kg/m^3, held at x = 0."""
    mu = lam = 1e5
    material = sp.StableNeoHookean(youngs=mu * (3 * lam + 2 * mu) / (lam + mu), poisson=lam / 2 / (lam + mu), density=1e3)
    mesh = sp.shapes.box(size=(1.2, 0.4, 0.4), divisions=(12 * scale, 4 * scale, 4 * scale))
    low = mesh.vertices.min(axis=0)
    held = sp.Pin("beam", sp.InBox(low - 1e-9, (low[0] + 1e-9, 1e3, 1e3)))
    return sp.Scene(bodies=[sp.Body("beam", mesh, material)], pins=[held])


def main() -> None:
    kind, scale, substeps, frames = sys.argv[1], *map(int, sys.argv[2:5])
    scene = beam_scene(scale)
    solver = {"xpbd": lambda: sp.XPBD(substeps=substeps)}[kind]()
    list(sp.simulate(scene, solver, dt=1 / 60, steps=1))  # compiles, or loads the cache
    stepping = sp.simulate(scene, solver, dt=1 / 60, steps=frames)
    seconds = 0.0
    frame = None
    start = time.perf_counter()
    for frame in stepping:
        pass
    seconds = time.perf_counter() - start
    assert frame is not None
    x = frame.positions["beam"]
    if len(sys.argv) > 5:
        np.save(sys.argv[5], np.column_stack([scene.bodies[0].mesh.vertices, x]))
    print(
        json.dumps(
            {
                "tets": len(scene.bodies[0].mesh.tets),
                "ms_per_frame": 1e3 * seconds / frames,
                "finite": bool(np.isfinite(x).all()),
                "lowest": float(x[:, 1].min()),
            }
        )
    )


if __name__ == "__main__":
    main()
