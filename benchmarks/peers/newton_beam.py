"""Hanging beam in Newton on the CPU. Prints one JSON line, with times of the processor. Runs in a separate environment.

usage: newton_beam.py vbd|xpbd SCALE SUBSTEPS ITERATIONS FRAMES [POSITIONS.npy]     (SCALE 1 -> 960 tets, 2 -> 7,680)
"""

import json
import sys
import time

import newton
import numpy as np
import warp as wp

wp.config.quiet = True
kind, scale, substeps, iterations, frames = sys.argv[1], *map(int, sys.argv[2:6])
builder = newton.ModelBuilder(up_axis=newton.Axis.Z)
builder.add_soft_grid(
    pos=wp.vec3(0, 0, 1),
    rot=wp.quat_identity(),
    vel=wp.vec3(0, 0, 0),
    dim_x=12 * scale,
    dim_y=4 * scale,
    dim_z=4 * scale,
    cell_x=0.1 / scale,
    cell_y=0.1 / scale,
    cell_z=0.1 / scale,
    density=1e3,
    k_mu=1e5,
    k_lambda=1e5,
    k_damp=0.0,
    fix_left=True,
)
builder.color()
model = builder.finalize(device="cpu")
if kind == "vbd":
    solver = newton.solvers.SolverVBD(model, iterations=iterations, particle_enable_tile_solve=False)
else:
    solver = newton.solvers.SolverXPBD(model, iterations=iterations)
control = model.control()
pipeline = newton.CollisionPipeline(model)
contacts = pipeline.contacts()


def frame(now, following):
    for _ in range(substeps):
        now.clear_forces()
        pipeline.collide(now, contacts)
        solver.step(now, following, control, contacts, 1 / 60 / substeps)
        now, following = following, now
    return now, following


frame(model.state(), model.state())  # compiles
now, following = model.state(), model.state()
start = time.process_time()
for _ in range(frames):
    now, following = frame(now, following)
seconds = time.process_time() - start
x = now.particle_q.numpy()
if len(sys.argv) > 6:
    np.save(sys.argv[6], np.column_stack([model.particle_q.numpy(), x]))
print(
    json.dumps(
        {
            "tets": int(model.tet_count),
            "ms_per_frame": 1e3 * seconds / frames,
            "finite": bool(np.isfinite(x).all()),
            "lowest": float(x[:, 2].min()),
        }
    )
)
