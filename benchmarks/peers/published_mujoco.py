"""A published case in MuJoCo. Prints one JSON line. Runs in a separate environment.

usage: published_mujoco.py PROBLEM.npz ANSWER.npz
"""

import sys
import time

import mujoco
import numpy as np
from published_problem import Relaxation, answer, read

own, out = read(sys.argv[1]), sys.argv[2]
LIMIT, DT = 60, {"impact": 1e-4, "rolling": 1e-3}
dt = DT.get(own.kind)
INTEGRATOR = "Euler" if own.kind == "impact" else "discrete"
if own.kind == "static":  # twenty passages of sound through the smallest edge
    edges = own.points[own.tets[:, 1:]] - own.points[own.tets[:, :1]]
    dt = 20 * float(np.linalg.norm(edges, axis=2).min() / np.sqrt(own.youngs / own.density))
hard = f'solref="{2 * dt} 1" solimp=".9999 .9999 1e-9"'
friction = f'friction="{own.friction} 0 0" condim="{3 if own.friction else 1}"'
if own.kind == "rolling":
    body = (
        f'<body pos="0 {own.radius} 0"><freejoint/><geom type="sphere" size="{own.radius}" mass="1" {friction} {hard}/>'
        "</body>"
    )
else:
    pins = f'<pin id="{" ".join(map(str, own.pinned))}"/>' if own.kind == "static" else ""
    body = (
        f'<flexcomp name="body" type="direct" dim="3" mass="{own.masses().sum()}" radius="1e-9" '
        f'point="{" ".join(map(repr, own.points.ravel().tolist()))}" element="{" ".join(map(str, own.tets.ravel()))}">'
        f'<elasticity young="{own.youngs}" poisson="{own.poisson}" damping="0"/><edge equality="false"/>{pins}'
        f'<contact selfcollide="none" condim="1" {hard}/></flexcomp>'
    )
floor = f'<geom type="plane" size="50 50 .1" euler="-90 0 0" {friction} {hard}/>' if own.floor else ""
xml = f"""<mujoco><option timestep="{dt}" integrator="{INTEGRATOR}" solver="CG" tolerance="1e-10" iterations="500"
 gravity="{" ".join(map(str, own.gravity))}"/><size memory="4G"/><worldbody>{floor}{body}</worldbody></mujoco>"""
model = mujoco.MjModel.from_xml_string(xml)
data = mujoco.MjData(model)
settings = f"steps of {1e3 * dt:.2g} ms of its integrator `{INTEGRATOR}`"
began = time.process_time()
if own.kind == "static":
    bodies = np.array(model.flex_vertbodyid)
    # Pinned vertices belong to the world, so that their places are constants of the model.
    model.flex_vert[own.pinned] += own.moved - own.points[own.pinned]
    data.xfrc_applied[bodies, :3] = own.forces
    data.xfrc_applied[0] = 0.0
    masses = np.zeros(model.nv)
    for axis in range(3):
        free = bodies > 0
        masses[model.body_dofadr[bodies[free]] + axis] = model.body_mass[bodies[free]]
    relaxation = Relaxation(LIMIT)
    while not relaxation.done:
        mujoco.mj_step(model, data)
        if relaxation.stops(float(masses @ data.qvel**2)):
            data.qvel[:] = 0.0
    arrays = {"positions": np.array(data.flexvert_xpos)}
    settings += f", kinetic damping, {relaxation.why}"
else:
    if own.kind == "impact":
        dofs, shares = model.body_dofadr[model.flex_vertbodyid], own.masses() / own.masses().sum()
        for axis in range(3):
            data.qvel[dofs + axis] = own.velocity[axis]
    else:
        data.qvel[:3] = own.velocity
    times, velocities, lowest = [], [], []
    while data.time < own.time:
        mujoco.mj_step(model, data)
        times.append(data.time)
        if own.kind == "impact":
            velocities.append([shares @ data.qvel[dofs + axis] for axis in range(3)])
            lowest.append(data.flexvert_xpos[:, 1].min())
        else:
            velocities.append(data.qvel[:3].copy())
    arrays = {"times": np.array(times), "velocities": np.array(velocities), "lowest": np.array(lowest)}
answer(out, mujoco.__version__, settings, began, **arrays)
