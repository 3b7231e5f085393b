"""A published case in SuperDex, in float64. Prints one JSON line. Runs in an environment of Python 3.12 or newer.

usage: published_superdex.py PROBLEM.npz ANSWER.npz
"""

import os
import sys
import time
from importlib.metadata import version

import numpy as np
from published_problem import answer, read

os.environ["SUPERDEX_PRECISION"] = "fp64"
import superdex.physics as sdp

own, out = read(sys.argv[1]), sys.argv[2]
STEPS, DT, ITERATIONS = 10, {"impact": 1e-4, "rolling": 1e-3}, 100
# Of the floor, stiff and sharp; by default 1e9 Pa/m, and a transition of 1 cm that begins 1 mm above it.
PENALTY, SMOOTHING, FALLOFF = 1e10, 1e-6, 1e-4
FAR = 1e6  # metres to the targets of the springs that are the loads

sdp.initialize(num_worker_threads=0)
scene = sdp.create_scene("published")
scene.set_gravity(list(map(float, own.gravity)))
solver = sdp.SolverParams()
newton = solver.non_linear_solver
newton.max_iter, newton.line_search_max_iter = ITERATIONS, 20
newton.abs_tol, newton.rel_tol = 1e-8, 1e-9
newton.psd_proj_mode = sdp.PsdProjectionMode.IF_FAIL_RETRY
newton.line_search_type = sdp.LineSearchType.ARMIJO_OR_RESIDUAL_NORM
if own.kind == "static":
    newton.convergence_mode = sdp.NonLinearSolverConvergenceMode.GLOBAL
else:
    solver.integration_method = sdp.IntegrationMethod.SYMPLECTIC_DIRK22
solver.linear_solver.solver_type = sdp.LinearSolverType.LDLT
solver.linear_solver.preconditioner_type = sdp.PreconditionerType.NONE
scene.set_solver_params(solver)
contact = sdp.ContactParams()
contact.penalty_coefficient, contact.penalty_threshold_default = PENALTY, 0.0
contact.penalty_smoothing_half_distance, contact.friction_falloff_vel = SMOOTHING, FALLOFF
contact.coulomb_friction_coefficient = float(own.friction)
if own.floor:
    scene.create_rigid_actor(shape=sdp.create_plane_shape([0, 1, 0], 0.0), is_static=True, contact=contact)
settings = f"float64, at most {ITERATIONS} Newton iterations"
if own.floor:
    settings += f", penalty {PENALTY:.0e} Pa/m"


def soft(inertia):
    """The body."""
    material = sdp.SoftMaterialParams()
    law = sdp.SoftMaterialType.ST_VENANT_KIRCHHOFF if own.kind == "static" else sdp.SoftMaterialType.NEO_HOOKEAN
    material.type, material.density = law, float(own.density)
    for part in (material.st_venant_kirchhoff, material.neo_hookean):
        part.youngs_modulus, part.poisson_ratio = float(own.youngs), float(own.poisson)
    shape = sdp.create_tet_mesh_shape(own.points.ravel(), own.tets.ravel().astype(np.int32))
    body = scene.create_soft_actor(shape=shape, material=material, contact=contact, has_inertia=inertia)
    still = sdp.RecenteringParams()
    still.use_recentering = False
    body.set_recentering_params(still)
    return body


def places(body):
    """(n, 3) the body's points."""
    return own.points + np.array(body.get_displacements()).reshape(-1, 3)


def checked_step(dt):
    """A step, which must converge."""
    scene.step(dt)
    found = scene.get_solver_stats()
    if found.convergence_status != sdp.ConvergenceStatus.CONVERGED:
        unconverged.append(found.residual_norm)


unconverged = []
began = time.process_time()
if own.kind == "static":
    body = soft(inertia=False)
    loaded = np.flatnonzero(np.linalg.norm(own.forces, axis=1) > 0)
    springs = [
        scene.create_deformable_node_position_constraint(
            stiffness=float(np.linalg.norm(own.forces[i])) / FAR, node_index=int(i), position=own.points[i],
            actor=body.get_handle(),
        )
        for i in loaded
    ]  # fmt: skip
    body.register_query(sdp.QueryType.CONTACT_POINTS)
    for share in np.arange(1, STEPS + 1) / STEPS:
        body.clear_boundary_conditions()
        at = own.points[own.pinned] + share * (own.moved - own.points[own.pinned])
        body.add_boundary_condition_nodes_world(own.pinned.astype(np.int32), at.ravel())
        for spring, i in zip(springs, loaded, strict=True):
            f = own.forces[i]
            spring.set_target_position(own.points[i] + share * FAR * f / np.linalg.norm(f))
        checked_step(1.0)
    found = list(body.get_contact_points_world()) if own.floor else []
    arrays = {"positions": places(body)}
    if found:
        arrays["contact_points"] = np.array([np.array(c.pos_a) for c in found])
        arrays["contact_forces"] = np.array([np.array(c.force) for c in found])
    settings += f", {STEPS} quasi-static steps" + (", loads by weak springs to far targets" if springs else "")
else:
    dt = DT[own.kind]
    times, velocities, lowest = [], [], []
    if own.kind == "impact":
        body, share = soft(inertia=True), own.masses() / own.masses().sum()
        body.set_velocity(list(map(float, own.velocity)), [0.0, 0.0, 0.0])
    else:
        J = 0.4 * float(own.radius) ** 2
        body = scene.create_rigid_actor(
            shape=sdp.create_tri_mesh_shape(own.points.ravel(), own.tets.ravel().astype(np.int32)), contact=contact,
            world_from_local=sdp.TransformRT(translation=[0, -float(own.points[:, 1].min()), 0]), mass=1.0,
            center_of_mass=[0, 0, 0], moment_of_inertia=[J, 0, 0, J, 0, J],
            linear_velocity=list(map(float, own.velocity)), collider_type=sdp.ColliderType.NONE,
        )  # fmt: skip
    x = places(body) if own.kind == "impact" else None
    for k in range(round(own.time / dt)):
        checked_step(dt)
        times.append((k + 1) * dt)
        if x is not None:
            now = places(body)
            velocities.append(share @ (now - x) / dt)
            lowest.append(now[:, 1].min())
            x = now
        else:
            velocities.append(np.array(body.get_linear_velocity()))
    arrays = {"times": np.array(times), "velocities": np.array(velocities), "lowest": np.array(lowest)}
    settings += f", steps of {1e3 * dt:g} ms of {solver.integration_method.name}"
if unconverged:
    settings += f"; {len(unconverged)} steps did not converge, residual {max(unconverged):.0e}"
answer(out, version("superdex-physics"), settings, began, **arrays)
