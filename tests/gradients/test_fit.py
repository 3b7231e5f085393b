"""Parameters that made data are found again from them."""

import numpy as np
import pytest
from tests.gradients import scenes
from tests.gradients.scenes import implicit

import supple as sp

TRUE = np.array([1.3, 0.8])
STEPS = 6


def film(p, noise=0.0):
    """Positions of the bar's vertices over the frames, with noise [m]."""
    frames = sp.simulate(scenes.cantilever([p[0], p[1], 1, 1]), implicit(), dt=0.01, steps=STEPS)
    seen = np.array([frame.positions["bar"] for frame in frames])
    return seen + noise * np.random.default_rng(0).standard_normal(seen.shape)


def misfit_of(target):
    loss = sp.Misfit("positions", "bar", target)
    return sp.Sensitivity(lambda p: scenes.cantilever([p[0], p[1], 1, 1]), loss, implicit(), dt=0.01, steps=STEPS)


def test_least_squares_without_noise(tmp_path):
    lines = []
    log = tmp_path / "fit.csv"
    found = sp.fit_simulation(misfit_of(film(TRUE)), [1, 1], names=["youngs", "density"], log=log, report=lines.append)
    assert found.values == pytest.approx(TRUE, rel=1e-6)
    assert found.evaluations == len(lines) == len(log.read_text().splitlines()) - 1 <= 12
    assert found.plot(tmp_path / "fit.png").stat().st_size > 1000
    again = sp.fit_simulation(misfit_of(film(TRUE)), [1, 1], names=["youngs", "density"], log=log)
    assert again.evaluations <= 2
    with pytest.raises(sp.SceneError, match="has the columns loss, youngs, density"):
        sp.fit_simulation(misfit_of(film(TRUE)), [1, 1], names=["a", "b"], log=log)


def test_standard_errors_say_what_noise_does():
    found = sp.fit_simulation(misfit_of(film(TRUE, noise=1e-5)), [1, 1], bounds=(0.1, 10))
    assert (np.abs(found.values - TRUE) < 3 * found.standard_errors).all()
    assert (found.standard_errors < 0.02 * TRUE).all()
    assert "+-" in str(found)


def test_what_readings_do_not_determine_has_no_standard_error():
    """Of an undamped body, they give modulus over density."""
    frames = sp.simulate(scenes.damped([1.2, 1, 0]), implicit(), dt=0.01, steps=STEPS)
    loss = sp.Misfit("positions", "bar", [frame.positions["bar"] for frame in frames])
    one = sp.Sensitivity(lambda p: scenes.damped([p[0], p[1], 0]), loss, implicit(), dt=0.01, steps=STEPS)
    found = sp.fit_simulation(one, [1.0, 1.0], bounds=(0.1, 10))
    assert found.values[0] / found.values[1] == pytest.approx(1.2, rel=1e-4)
    assert np.isnan(found.standard_errors).all()


def test_a_loss_of_ones_own_goes_to_the_gradient():
    height = film([1.3, 1])[-1, -1, 1]

    def end_height(frame):
        if frame.index < STEPS:
            return None
        y = frame.positions["bar"]
        by = np.zeros_like(y)
        off = y[-1, 1] - height
        by[-1, 1] = 2 * off
        return off**2, {"bar": by}

    one = sp.Sensitivity(lambda p: scenes.cantilever([p[0], 1, 1, 1]), end_height, implicit(), dt=0.01, steps=STEPS)
    found = sp.fit_simulation(one, [1.0], bounds=(0.2, 5), tolerance=1e-14)
    assert found.values == pytest.approx([1.3], rel=1e-3)
    assert np.isnan(found.standard_errors).all()


def test_jacobians_are_those_of_differences():
    one = misfit_of(film(TRUE))
    p, e = np.array([1.0, 1.1]), 1e-5
    residuals, J = one.residuals_and_jacobian(p)
    differences = [(one.residuals(p + e * way) - one.residuals(p - e * way)) / (2 * e) for way in np.eye(2)]
    assert np.array_equal(residuals, one.residuals(p))
    assert np.abs(J - np.transpose(differences)).max() <= 1e-7 * np.abs(J).max()


@pytest.mark.parametrize("name", ["sticking", "on_ball", "held_by_rigid", "filled", "viscoelastic", "driven_to"])
def test_jacobians_and_gradients_agree(name):
    scene_of = getattr(scenes, name)
    q = 3 if name == "filled" else 4
    loss = [sp.Misfit("positions", "bar", np.full((1, 3), 0.1), vertices=[5])]
    if name == "driven_to":
        loss.append(sp.Misfit("reaction", "pin of body 'base'", [1.0, 2.0, 3.0], weight=1e-3))
    one = sp.Sensitivity(scene_of, loss, implicit(), dt=0.01, steps=STEPS)
    gradient = one.value_and_gradient(np.ones(q))[1]
    residuals, J = one.residuals_and_jacobian(np.ones(q))
    assert np.abs(2 * residuals @ J - gradient).max() <= 1e-5 * np.abs(gradient).max()


def test_what_does_not_exist_is_named():
    for quantity, of, text in (
        ("reaction", "grip", "pin or obstacle 'grip' does not exist"),
        ("positions", "baar", "'baar'"),
    ):
        target = [0.0, 0.0, 0.0] if quantity == "reaction" else np.zeros((1, 3))
        one = sp.Sensitivity(
            lambda p: scenes.damped([p[0], 1, 1]), sp.Misfit(quantity, of, target), implicit(), 0.01, 1
        )
        with pytest.raises(sp.SceneError, match=text):
            one.value([1.0])
    with pytest.raises(sp.SceneError, match="quantity 'place' does not exist"):
        sp.Misfit("place", "bar", np.zeros((1, 3)))
    with pytest.raises(sp.SceneError, match="frames 1 to 6"):
        misfit_of(np.zeros((9, 20, 3)))
    with pytest.raises(sp.SceneError, match="2 names for 1 parameters"):
        sp.fit_simulation(misfit_of(np.zeros((20, 3))), [1.0], names=["a", "b"])
