"""A scene of `checked_scenes` in Newton on the CPU. Prints one JSON line. Runs in a separate environment.

usage: checked_newton.py SCENE vbd|xpbd OUT.npz
"""

import json
import sys

import newton
import numpy as np
import warp as wp
from checked_scenes import DENSITY, FPS, FRAMES, POISSON, YOUNGS, save, scene

wp.config.quiet = True
name, kind, out = sys.argv[1:4]
SUBSTEPS, ITERATIONS = 10, 10
# XPBD finds contact between particles, which are 0.1 m apart; VBD between triangles and points.
RADIUS = 0.04 if kind == "xpbd" else 0.01
own = scene(name)
# Of Newton's law, as of Supple's, the first Lamé parameter of small strains is k_lambda - k_mu.
mu, lam = YOUNGS / 2 / (1 + POISSON), YOUNGS * POISSON / (1 + POISSON) / (1 - 2 * POISSON)
builder = newton.ModelBuilder(up_axis=newton.Axis.Z, gravity=(0.0, 0.0, own.gravity))
for points, _, tets in own.bodies():
    builder.add_soft_mesh(
        pos=wp.vec3(0, 0, 0), rot=wp.quat_identity(), scale=1.0, vel=wp.vec3(0, 0, 0),
        vertices=[wp.vec3(*map(float, x)) for x in points], indices=tets.ravel().tolist(),
        density=DENSITY, k_mu=mu, k_lambda=lam + mu, k_damp=0.0, particle_radius=RADIUS,
    )  # fmt: skip
if own.floor:
    builder.add_ground_plane()
builder.color()
model = builder.finalize(device="cpu")
assert np.allclose(model.particle_q.numpy(), own.points, atol=1e-5)
if kind == "vbd":
    solver = newton.solvers.SolverVBD(
        model, iterations=ITERATIONS, particle_enable_self_contact=True, particle_self_contact_radius=0.01,
        particle_self_contact_margin=0.015, particle_enable_tile_solve=False,
    )  # fmt: skip
else:
    solver = newton.solvers.SolverXPBD(model, iterations=ITERATIONS)
control, pipeline = model.control(), newton.CollisionPipeline(model)
contacts = pipeline.contacts()
now, following = model.state(), model.state()
for state in (now, following):
    state.particle_qd.assign(own.velocities.astype(np.float32))
frames = [now.particle_q.numpy().astype(np.float64)]
for _ in range(FRAMES):
    for _ in range(SUBSTEPS):
        now.clear_forces()
        pipeline.collide(now, contacts)
        solver.step(now, following, control, contacts, 1 / FPS / SUBSTEPS)
        now, following = following, now
    frames.append(now.particle_q.numpy().astype(np.float64))
save(out, frames, own, model.particle_mass.numpy())
print(json.dumps({"version": newton.__version__}))
