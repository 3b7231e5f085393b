"""A published case in PyBullet. Prints one JSON line. Runs in a separate environment.

usage: published_pybullet.py PROBLEM.npz ANSWER.npz
"""

import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pybullet as p
from published_problem import answer, read, refuse

own, out = read(sys.argv[1]), sys.argv[2]
DT = {"impact": 2e-5, "rolling": 1e-3}
if own.kind == "static":
    refuse(version("pybullet"), "points of soft bodies take no forces, and held points cannot move")
p.connect(p.DIRECT)
if own.kind == "rolling":
    dt = DT[own.kind]
    p.setGravity(*map(float, own.gravity))
    floor = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE, planeNormal=[0, 1, 0]))
    ball = p.createMultiBody(
        1.0, p.createCollisionShape(p.GEOM_SPHERE, radius=own.radius), basePosition=[0, own.radius, 0]
    )
    J = 0.4 * own.radius**2
    p.changeDynamics(
        ball, -1, lateralFriction=own.friction, linearDamping=0, angularDamping=0, localInertiaDiagonal=[J] * 3
    )
    p.changeDynamics(floor, -1, lateralFriction=1.0)
    p.resetBaseVelocity(ball, list(map(float, own.velocity)))
else:
    p.resetSimulation(p.RESET_USE_DEFORMABLE_WORLD)
    dt = DT[own.kind]
    p.setGravity(0, 0, 0)
    if own.floor:
        p.createMultiBody(0, p.createCollisionShape(p.GEOM_BOX, halfExtents=[5, 0.5, 5]), basePosition=[0, -0.5, 0])
    # Of PyBullet's law, that of Smith and others (2018), these have the Lamé parameters of small strains.
    lam, mu = own.lame()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "body.vtk"
        rows = "\n".join(" ".join(map(repr, x)) for x in own.points.tolist())
        cells = "\n".join("4 " + " ".join(map(str, t)) for t in own.tets.tolist())
        file.write_text(
            f"# vtk DataFile Version 2.0\nbody\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {len(own.points)} double\n"
            f"{rows}\nCELLS {len(own.tets)} {5 * len(own.tets)}\n{cells}\nCELL_TYPES {len(own.tets)}\n"
            + "10\n"
            * len(own.tets)
        )
        body = p.loadSoftBody(
            str(file), mass=float(own.masses().sum()), useNeoHookean=1, NeoHookeanMu=4 / 3 * mu,
            NeoHookeanLambda=lam + 5 / 6 * mu, NeoHookeanDamping=0.0, collisionMargin=1e-3, frictionCoeff=own.friction,
        )  # fmt: skip
p.setTimeStep(dt)


def places():
    """(n, 3) the body's points."""
    return np.array(p.getMeshData(body, -1, flags=p.MESH_DATA_SIMULATION_MESH)[1])


settings = f"steps of {1e3 * dt:.2g} ms, speed by gravity before the impact"
began = time.process_time()
times, velocities, lowest = [], [], []
if own.kind == "rolling":
    settings = f"steps of {1e3 * dt:.2g} ms"
    x = None
else:
    # Points have no velocities at the start; a gravity of 1,000 m/s^2 gives them.
    x, share = places(), own.masses() / own.masses().sum()
    p.setGravity(*(1e3 * np.sign(own.velocity)))
for k in range(round(own.time / dt)):
    if x is not None and k * dt >= 1e-3 * np.abs(own.velocity).max() - 1e-9:
        p.setGravity(0, 0, 0)
    p.stepSimulation()
    times.append((k + 1) * dt)
    if x is None:
        velocities.append(p.getBaseVelocity(ball)[0])
    else:
        now = places()
        velocities.append(share @ (now - x) / dt)
        lowest.append(now[:, 1].min())
        x = now
arrays = {"times": np.array(times), "velocities": np.array(velocities), "lowest": np.array(lowest)}
answer(out, version("pybullet"), settings, began, **arrays)
