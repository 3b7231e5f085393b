"""Gradients are those of central differences of whole runs."""

import numpy as np
import pytest
from tests.gradients import scenes
from tests.gradients.scenes import implicit

import supple as sp

STEPS = 6


def targets(count, frames):
    return np.random.default_rng(1).standard_normal((frames, count, 3)) * 0.1


def sensitivity(scene_of, q, solver, steps=STEPS, loss=None):
    body = scene_of(np.ones(q)).body("bar")
    count = len(body.points) if isinstance(body, sp.RigidBody) else len(body.mesh.vertices)
    loss = loss or sp.Misfit("positions", "bar", targets(count, min(steps, 2)))
    return sp.Sensitivity(scene_of, loss, solver, dt=0.01, steps=steps)


SMOOTH = [
    (scenes.cantilever, 4),
    (scenes.rest_shape, 2),
    (scenes.damped, 3),
    (scenes.pulled, 3),
    (scenes.flight, 4),
    (scenes.quadratic, 3),
    (scenes.pressed, 4),
    (scenes.in_field, 4),
    (scenes.twisted, 3),
    (scenes.on_moving_floor, 4),
    (scenes.chain, 3),
    (scenes.stitched, 4),
    (scenes.sewn, 4),
    (scenes.held_by_rigid, 4),
    (scenes.inflated, 3),
    (scenes.filled, 3),
    (scenes.tendon, 4),
    (scenes.muscle, 3),
    (scenes.viscoelastic, 4),
    (scenes.tumbling, 4),
    (scenes.hinge, 3),
    (scenes.driven_to, 4),
    (scenes.driven_at, 2),
]


IN_CONTACT = [
    (scenes.landing, "bdf2", 1, 1e-5),
    (scenes.landing_roughly, "backward_euler", None, 1e-4),
    (scenes.tilted, "bdf2", None, 1e-5),
    (scenes.tilted, "backward_euler", 2, 1e-5),
    (scenes.fork, "bdf2", None, 1e-5),
]


@pytest.mark.parametrize(("scene_of", "q"), SMOOTH, ids=lambda value: getattr(value, "__name__", ""))
def test_bdf2(scene_of, q):
    check = sensitivity(scene_of, q, implicit()).check(np.ones(q), 1, step=1e-5)
    assert check.relative <= 1e-5, str(check)


@pytest.mark.parametrize(("scene_of", "q"), [(scenes.cantilever, 4), (scenes.damped, 3), (scenes.viscoelastic, 4)])
def test_backward_euler(scene_of, q):
    check = sensitivity(scene_of, q, implicit("backward_euler")).check(np.ones(q), 1, step=1e-5)
    assert check.relative <= 1e-6, str(check)


@pytest.mark.parametrize(
    ("scene_of", "q"), [(scenes.cantilever, 4), (scenes.rest_shape, 2), (scenes.pulled, 3), (scenes.muscle, 3)]
)
def test_equilibria(scene_of, q):
    check = sensitivity(scene_of, q, implicit("static"), 2).check(np.ones(q), 1, step=1e-5)
    assert check.relative <= 1e-6, str(check)


@pytest.mark.parametrize("integrator", ["bdf2", "backward_euler"])
@pytest.mark.parametrize("scene_of", [scenes.frictionless, scenes.sliding, scenes.sticking, scenes.on_ball])
def test_contact_with_obstacles(scene_of, integrator):
    check = sensitivity(scene_of, 4, implicit(integrator), 8).check(np.ones(4), 1, step=1e-5)
    assert check.relative <= 1e-5, str(check)


@pytest.mark.parametrize(
    ("scene_of", "integrator", "friction_iterations", "limit"),
    IN_CONTACT,
    ids=lambda value: getattr(value, "__name__", value),
)
def test_contact_of_bodies(scene_of, integrator, friction_iterations, limit):
    """With areas of contacts that change: they belong to the ends of steps, and are differentiated."""
    solver = implicit(integrator, friction_iterations)
    one = sensitivity(scene_of, 4, solver, 8)
    check = one.check(np.ones(4), 2, step=1e-6)
    assert check.relative <= limit, str(check)
    residuals, jacobian = one.residuals_and_jacobian(np.ones(4))
    assert 2.0 * residuals @ jacobian == pytest.approx(one.gradient(np.ones(4)).by_parameters, rel=1e-4, abs=1e-9)


def test_a_step_without_an_end_that_has_its_own_areas_is_told(monkeypatch):
    monkeypatch.setattr("supple.gradients.settled._MOST", 0)
    one = sensitivity(scenes.landing, 4, implicit(), 8)
    with pytest.warns(sp.SuppleWarning, match="areas of contacts and forces of friction"):
        one.gradient(np.ones(4))
    with pytest.warns(sp.SuppleWarning, match="areas of contacts and forces of friction"):
        one.residuals_and_jacobian(np.ones(4))


@pytest.mark.parametrize("friction_iterations", [None, 2, 30])
def test_friction_with_the_normal_forces_of_the_end(friction_iterations):
    solver = implicit("backward_euler", friction_iterations)
    check = sensitivity(scenes.sliding, 4, solver).check(np.ones(4), 1, step=1e-5)
    assert check.relative <= 1e-5, str(check)


def test_reactions_and_velocities():
    loss = [
        sp.Misfit("reaction", "pin of body 'bar'", [[1.0, 2.0, 3.0], [0.5, 0.0, 0.0]], frames=[2, 6], weight=1e-3),
        sp.Misfit("velocities", "bar", np.full((2, 3), 0.1), vertices=[7, 9]),
        sp.Misfit("center", "bar", [1.0, 0.5, np.nan], vertices=[3, 7, 9]),
    ]
    check = sensitivity(scenes.damped, 3, implicit(), loss=loss).check(np.ones(3), 1, step=1e-5)
    assert check.relative <= 1e-6, str(check)


def test_losses_of_ones_own_and_what_was_not_measured():
    def highest(frame):
        y = frame.positions["bar"][:, 1]
        by = np.zeros((len(y), 3))
        by[:, 1] = np.exp(y) / len(y)
        return float(np.exp(y).mean()), {"bar": by}

    seen = targets(20, 1)[0]
    seen[3:9] = np.nan
    loss = [highest, sp.Misfit("positions", "bar", seen)]
    check = sensitivity(scenes.damped, 3, implicit(), loss=loss).check(np.ones(3), 1, step=1e-5)
    assert check.relative <= 1e-6, str(check)


def test_starts():
    """By where and how fast every vertex starts: the same as by a parameter that moves them."""
    flight = sensitivity(scenes.flight, 4, implicit())
    found = flight.gradient(np.ones(4))
    assert found.by_parameters[1] == pytest.approx(found.start_velocities["bar"][:, 0].sum(), rel=1e-8)
    assert found.by_parameters[2] == pytest.approx(found.start_velocities["bar"][:, 1].sum(), rel=1e-8)


def test_what_is_not_differentiated_says_so():
    def with_solver(solver):
        return sensitivity(scenes.cantilever, 4, solver)

    with pytest.raises(sp.SolverError, match="XPBD has no equations"):
        with_solver(sp.XPBD())  # pyright: ignore[reportArgumentType]
    with pytest.raises(sp.SolverError, match="'newmark' is not differentiated"):
        with_solver(sp.Implicit(integrator="newmark")).gradient(np.ones(4))
    with pytest.raises(sp.SolverError, match="linearizations do not end"):
        with_solver(sp.Implicit(max_iterations=1)).gradient(np.ones(4))
    with pytest.raises(sp.SolverError, match="simulate: frame 1 of 6"):
        with_solver(sp.Implicit(max_iterations=4, tolerance=1e-14, max_substeps=1)).gradient(np.ones(4))
    with pytest.raises(sp.SceneError, match="changes which tets"):
        sensitivity(lambda p: scenes.cantilever(p) if p[0] <= 1 else scenes.tumbling(p), 4, implicit()).gradient(
            np.ones(4)
        )
