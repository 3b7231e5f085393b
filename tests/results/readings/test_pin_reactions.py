"""Reactions of pins in both solvers: what a held body weighs, and what is not known."""

import numpy as np
import pytest

import supple as sp

RUBBER = sp.StableNeoHookean(youngs=2e5, poisson=0.3, density=1000.0, damping=0.1)
MESH = sp.shapes.box((0.3, 0.1, 0.1), (6, 2, 2))
ENDS = [sp.Pin("bar", sp.InBox((s * 0.16 - 0.02, -1, -1), (s * 0.16 + 0.02, 1, 1)), name="end") for s in (-1, 1)]
FIRST, SECOND = "pin 'end' of body 'bar'", "pin 'end' of body 'bar' #2"
WEIGHT = 9.81 * 3.0


def held(solver, dt, steps, pins, **parts):
    scene = sp.Scene([sp.Body("bar", MESH, parts.pop("material", RUBBER))], pins=pins, **parts)
    *_, frame = sp.simulate(scene, solver, dt=dt, steps=steps)
    return frame


SOLVERS = {
    "implicit": (sp.Implicit(tolerance=1e-9), 0.2, 15, 1e-6),
    "xpbd": (sp.XPBD(substeps=20), 1 / 60, 60, 0.02),
}


@pytest.mark.parametrize("name", SOLVERS)
def test_pins_carry_the_weight_and_the_loads(name):
    *settings, tolerance = SOLVERS[name]
    up = sp.Traction("bar", (0, 500.0, 0), region=sp.InBox((-1, -0.06, -1), (1, -0.04, 1)))
    total = WEIGHT - 500.0 * 0.03
    one = held(*settings, ENDS[:1], loads=[up])
    np.testing.assert_allclose(one.reactions[FIRST], [0, total, 0], atol=tolerance * WEIGHT)
    two = held(*settings, ENDS)
    assert list(two.reactions) == [FIRST, SECOND]
    both = two.reactions[FIRST] + two.reactions[SECOND]
    np.testing.assert_allclose(both, [0, WEIGHT, 0], atol=tolerance * WEIGHT)
    assert two.reactions[FIRST][1] == pytest.approx(0.5 * WEIGHT, rel=0.05)


def test_what_is_not_known_is_one_line():
    rigid = sp.EdgesAndVolume()
    one = held(sp.XPBD(substeps=2), 0.01, 1, ENDS[:1], material=rigid)
    gained = one.report.linear_momentum / 0.01
    np.testing.assert_allclose(one.reactions[FIRST], np.add(gained, [0, WEIGHT, 0]), atol=1e-9)
    frame = held(sp.XPBD(substeps=2), 0.01, 1, ENDS, material=rigid)
    with pytest.raises(
        sp.SceneError, match=r"pin 'end' of body 'bar': its force is not known: .* rigid edges or volumes"
    ):
        frame.reactions  # noqa: B018
