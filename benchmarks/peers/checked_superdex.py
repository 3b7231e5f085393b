"""A scene of `checked_scenes` in SuperDex. Prints one JSON line. Runs in an environment of Python 3.12 or newer.

usage: checked_superdex.py SCENE OUT.npz
"""

import json
import sys
from importlib.metadata import version

import numpy as np
import superdex.physics as sdp
from checked_scenes import DENSITY, FPS, FRAMES, POISSON, YOUNGS, lumped_masses, save, scene

name, out = sys.argv[1:3]
STEPS, ITERATIONS = 4, 20
own = scene(name)
sdp.initialize(num_worker_threads=0)
world = sdp.create_scene(name)
world.set_gravity([0.0, 0.0, own.gravity])
solver = sdp.SolverParams()
solver.non_linear_solver.max_iter = ITERATIONS
world.set_solver_params(solver)
if own.floor:
    world.create_rigid_actor(shape=sdp.create_plane_shape([0, 0, 1], 0.0), is_static=True)
bodies = []
for points, velocities, tets in own.bodies():
    given, more = sdp.SoftActorParams(), sdp.experimental.ExperimentalSoftActorParams()
    given.shape = sdp.create_tet_mesh_shape(points.ravel(), tets.ravel().astype(np.int32))
    # Without a collider, soft bodies have no contact with each other.
    more.collider_type, more.use_recentering = sdp.ColliderType.SDF, False
    material = given.material
    material.density = DENSITY
    material.neo_hookean.youngs_modulus, material.neo_hookean.poisson_ratio = YOUNGS, POISSON
    body = sdp.experimental.create_soft_actor(world, given, more)
    body.set_node_velocities_local(velocities.ravel())
    bodies.append((body, points))


def positions():
    """All points, in the order of the scene."""
    return np.concatenate([points + np.array(body.get_displacements()).reshape(-1, 3) for body, points in bodies])


frames = [positions()]
for _ in range(FRAMES):
    for _ in range(STEPS):
        world.step(1 / FPS / STEPS)
    frames.append(positions())
save(out, frames, own, lumped_masses(own))
print(json.dumps({"version": version("superdex-physics")}))
