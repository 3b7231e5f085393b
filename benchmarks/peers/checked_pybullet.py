"""A scene of `checked_scenes` in PyBullet, without velocities at the start. Prints one JSON line.

usage: checked_pybullet.py SCENE OUT.npz
"""

import json
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pybullet as p
from checked_scenes import DENSITY, FPS, FRAMES, POISSON, YOUNGS, save, scene

name, out = sys.argv[1:3]
STEPS = 20
own = scene(name)
# Of PyBullet's law, that of Smith and others (2018), these have the Lamé parameters of small strains.
mu, lam = YOUNGS / 2 / (1 + POISSON), YOUNGS * POISSON / (1 + POISSON) / (1 - 2 * POISSON)
p.connect(p.DIRECT)
p.resetSimulation(p.RESET_USE_DEFORMABLE_WORLD)
p.setGravity(0, 0, own.gravity)
p.setTimeStep(1 / FPS / STEPS)
if own.floor:
    p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[5, 5, 0.5]), basePosition=[0, 0, -0.5])
bodies, masses = [], []
with tempfile.TemporaryDirectory() as folder:
    for k, (points, _, tets) in enumerate(own.bodies()):
        edges = points[tets[:, 1:]] - points[tets[:, :1]]
        mass = DENSITY * float(np.abs(np.linalg.det(edges)).sum()) / 6
        masses.append(np.full(len(points), mass / len(points)))  # PyBullet gives all points the same
        file = Path(folder) / f"body{k}.vtk"
        rows = "\n".join(" ".join(map(repr, x)) for x in points.tolist())
        cells = "\n".join("4 " + " ".join(map(str, t)) for t in tets.tolist())
        file.write_text(
            f"# vtk DataFile Version 2.0\nbody\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {len(points)} double\n{rows}\n"
            f"CELLS {len(tets)} {5 * len(tets)}\n{cells}\nCELL_TYPES {len(tets)}\n" + "10\n" * len(tets)
        )
        bodies.append(
            p.loadSoftBody(
                str(file),
                mass=mass,
                useNeoHookean=1,
                NeoHookeanMu=4 / 3 * mu,
                NeoHookeanLambda=lam + 5 / 6 * mu,
                NeoHookeanDamping=0.0,
                collisionMargin=0.005,
                useSelfCollision=1,
                useFaceContact=1,
                frictionCoeff=0.5,
            )
        )


def positions():
    """All points, in the order of the scene."""
    return np.concatenate([np.array(p.getMeshData(body, -1, flags=p.MESH_DATA_SIMULATION_MESH)[1]) for body in bodies])


frames = [positions()]
assert frames[0].shape == own.points.shape
assert np.allclose(frames[0], own.points, atol=1e-4)
for _ in range(FRAMES):
    for _ in range(STEPS):
        p.stepSimulation()
    frames.append(positions())
save(out, frames, own, np.concatenate(masses))
print(json.dumps({"version": version("pybullet")}))
