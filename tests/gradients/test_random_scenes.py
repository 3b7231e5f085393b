"""Scenes with random parts: no gradient is wrong by more than a thousandth without a message."""

import warnings

import numpy as np
import pytest
from tests.gradients import scenes

import supple as sp

MATERIALS = (sp.StableNeoHookean, sp.NeoHookean, sp.FixedCorotated, sp.StVenantKirchhoff)


def random_scene(seed):
    """A function of four parameters near 1, and a solver for it."""
    r = np.random.default_rng(seed)
    moves, floor, pinned, second = r.random() < 0.7, r.random() < 0.5, r.random() < 0.5, r.random() < 0.4
    static = pinned and not floor and r.random() < 0.3
    integrator = "static" if static else ("bdf2", "backward_euler")[r.integers(2)]
    law, young, nu = MATERIALS[r.integers(4)], 10 ** r.uniform(4.7, 6.5), r.uniform(0.1, 0.45)
    damping, angular, speed = 0.02 * (r.random() < 0.5), r.uniform(-2, 2, 3), r.uniform(-0.3, 0.3, 3)
    size, jiggle, mu, turn = r.uniform(0.08, 0.3, 3), r.uniform(-1, 1, (200, 3)), r.uniform(0, 0.8), r.uniform(-1, 1, 3)
    push, muscle, kind = r.uniform(-0.3, 0.3, 3), r.random() < 0.3, r.integers(3)

    def scene_of(p):
        mesh = sp.shapes.box(tuple(size), (3, 1, 2))
        mesh = sp.TetMesh(mesh.vertices + 0.1 * size / 3 * jiggle[: len(mesh.vertices)], mesh.tets)
        rubber = law(youngs=young * p[0], poisson=nu, density=900 * p[1], damping=damping)
        placed = {} if pinned else {"rotation": tuple(turn)}
        low = sp.Body("bar", mesh, rubber, **placed)
        lift = -low.place(mesh.vertices)[:, 1].min() + 1e-3
        rates = {} if pinned else {"velocity": tuple(speed * p[2] - (0, 0.2, 0)), "angular_velocity": tuple(angular)}
        body = sp.Body("bar", mesh, rubber, position=(0, lift, 0), **placed, **rates)
        parts = {"pins": [], "forces": [], "loads": [], "obstacles": []}
        bodies, held = [body], scenes.end(body, -1)
        if pinned:
            way = 0.05 * p[2] * turn if moves else np.zeros(3)
            parts["pins"].append(sp.Pin("bar", held, motion=lambda t: way * scenes.ramp(t)))
        far = scenes.end(body, 1)
        parts["forces"].append(sp.Force("bar", far, tuple(push * p[3])))
        if floor:
            parts["obstacles"].append(sp.HalfSpace(name="floor", friction=mu * p[3]))
        if muscle:
            parts["loads"].append(sp.Muscle("bar", 0.1 * young * p[2], (1, 0, 0), scenes.ramp))
        if second and kind == 0:
            parts["loads"].append(sp.Spring(("bar", int(far[0])), ("bar", int(held[-1])), stiffness=50 * p[2]))
        return sp.Scene(bodies, **parts)

    return scene_of, scenes.implicit(integrator)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_a_random_scene(seed):
    scene_of, solver = random_scene(seed)
    target = np.random.default_rng(seed).standard_normal((24, 3)) * 0.1
    one = sp.Sensitivity(scene_of, sp.Misfit("positions", "bar", target), solver, dt=0.01, steps=6)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        gradient = one.value_and_gradient(np.ones(4))[1]
    differences = np.array([(one.value(1 + 1e-6 * e) - one.value(1 - 1e-6 * e)) / 2e-6 for e in np.eye(4)])
    error = np.abs(gradient - differences).max() / np.abs(differences).max()
    assert error <= 1e-3 or told, (gradient, differences)
