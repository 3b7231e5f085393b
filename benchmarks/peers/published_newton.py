"""A published case in Newton's VBD on the CPU, in float32. Prints one JSON line. Runs in a separate environment.

usage: published_newton.py PROBLEM.npz ANSWER.npz
"""

import sys
import time

import newton
import numpy as np
import warp as wp
from published_problem import Relaxation, answer, read

wp.config.quiet = True
own, out = read(sys.argv[1]), sys.argv[2]
PASSAGES, ITERATIONS, LIMIT = 5, 20, 60
DT = {"impact": 1e-4, "rolling": 1e-3}
KE = 1e6
lam, mu = own.lame()
builder = newton.ModelBuilder(up_axis=newton.Axis.Y, gravity=tuple(map(float, own.gravity)))
contact = newton.ModelBuilder.ShapeConfig(ke=KE, kd=0.0, kf=0.0, mu=own.friction)
if own.floor:
    builder.add_ground_plane(cfg=contact)
if own.kind == "rolling":
    ball = builder.add_body(xform=wp.transform(wp.vec3(0, own.radius, 0), wp.quat_identity()))
    contact.density = 1.0 / (4 / 3 * np.pi * own.radius**3)
    builder.add_shape_sphere(ball, radius=own.radius, cfg=contact)
    dt = DT[own.kind]
else:
    # Of Newton's law, the first Lamé parameter of small strains is k_lambda - k_mu.
    builder.add_soft_mesh(
        pos=wp.vec3(0, 0, 0), rot=wp.quat_identity(), scale=1.0, vel=wp.vec3(*map(float, own.velocity)),
        vertices=[wp.vec3(*map(float, x)) for x in own.points], indices=own.tets.ravel().tolist(),
        density=float(own.density), k_mu=mu, k_lambda=lam + mu, k_damp=0.0, particle_radius=1e-6,
    )  # fmt: skip
    edges = own.points[own.tets[:, 1:]] - own.points[own.tets[:, :1]]
    passage = float(np.linalg.norm(edges, axis=2).min() / np.sqrt(own.youngs / own.density))
    dt = DT.get(own.kind, PASSAGES * passage)
    for i in own.pinned if own.kind == "static" else ():
        builder.particle_mass[i] = 0.0
builder.color()
model = builder.finalize(device="cpu")
model.soft_contact_ke, model.soft_contact_kd, model.soft_contact_mu = KE, 0.0, own.friction
solver = newton.solvers.SolverVBD(model, iterations=ITERATIONS, particle_enable_tile_solve=False)
control, pipeline = model.control(), newton.CollisionPipeline(model, soft_contact_margin=1e-3)
contacts = pipeline.contacts()
now, following = model.state(), model.state()
forces = None


def step():
    """Solves a step, and exchanges the states."""
    global now, following
    now.clear_forces()
    if forces is not None:
        now.particle_f.assign(forces)
    if own.floor:
        pipeline.collide(now, contacts)
    solver.step(now, following, control, contacts, dt)
    now, following = following, now


settings = f"float32, {ITERATIONS} iterations a step of {1e3 * dt:.2g} ms, contact of {KE:.0e} N/m"
times, velocities, lowest = [], [], []
step()  # compiles
now, following = model.state(), model.state()
began = time.process_time()
if own.kind == "static":
    forces = own.forces.astype(np.float32)
    masses = own.masses()
    masses[own.pinned] = 0.0
    x = own.points.copy()
    x[own.pinned] = own.moved
    for state in (now, following):
        state.particle_q.assign(x.astype(np.float32))
    relaxation = Relaxation(LIMIT)
    while not relaxation.done:
        step()
        if relaxation.stops(float(masses @ (now.particle_qd.numpy().astype(float) ** 2).sum(axis=1))):
            now.particle_qd.zero_()
    arrays = {"positions": now.particle_q.numpy().astype(np.float64)}
    settings += f", kinetic damping, {relaxation.why}"
else:
    shares = own.masses() / own.masses().sum() if own.kind == "impact" else None
    if shares is None:
        for state in (now, following):
            speeds = state.body_qd.numpy()
            speeds[0, :3] = own.velocity
            state.body_qd.assign(speeds)
    for k in range(round(own.time / dt)):
        step()
        times.append((k + 1) * dt)
        if shares is None:
            velocities.append(now.body_qd.numpy()[0, :3].astype(np.float64))
        else:
            velocities.append(shares @ now.particle_qd.numpy().astype(np.float64))
            lowest.append(now.particle_q.numpy()[:, 1].min())
    arrays = {"times": np.array(times), "velocities": np.array(velocities), "lowest": np.array(lowest)}
answer(out, newton.__version__, settings, began, **arrays)
