"""Shells with what holds, pulls and fills them: welds, cables, cavities, wind, all with contact."""

import numpy as np
import pytest
from tests.solvers.implicit.contact.test_shell_contact import CLOTH, sheet

import supple as sp


def checked(scene, steps, tmp_path):
    """The last frame of a run that passes all checks."""
    path = tmp_path / "parts.vtkhdf"
    *_, last = sp.simulate(scene, sp.Implicit(), dt=1 / 60, steps=steps, sinks=[sp.Recorder(path)])
    report = sp.check_recording(path)
    assert report.ok, str(report)
    return last


@pytest.mark.parametrize("gap", [0.0, 1.5e-3])
def test_cloth_that_is_welded_to_a_bar_hangs_from_it(gap, tmp_path):
    bar = sp.RigidBody("bar", sp.shapes.box(size=(0.01, 0.01, 0.06)).surface, density=2000.0)
    cloth = sp.Shell("cloth", sheet((4, 3), (0.05, 0.05)), CLOTH, position=(0.03 + gap, 0.0, 0.0))
    scene = sp.Scene(
        [cloth, bar],
        joints=[sp.HingeJoint("bar", None, point=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0))],
        welds=[sp.Weld("cloth", "bar", max_distance=2e-3)],
    )
    last = checked(scene, 4, tmp_path)
    x, turn = last.positions["cloth"], last.poses["bar"].rotation
    assert x[:, 1].mean() < -0.004
    held = np.isclose(cloth.mesh.vertices[:, 0], cloth.mesh.vertices[:, 0].min())
    there = (cloth.mesh.vertices[held] + cloth.position) @ turn.T + last.poses["bar"].translation
    np.testing.assert_allclose(x[held], there, atol=1e-6)


def test_cable_gathers_a_cloth(tmp_path):
    surface = sheet((6, 4), (0.1, 0.08))
    x = surface.vertices
    row = np.flatnonzero(np.abs(x[:, 2]) < 1e-9)
    points = [("cloth", int(v)) for v in row[np.argsort(x[row, 0])]]
    cable = sp.Cable(points, length=lambda time: 0.1 * (1.0 - time), stiffness=1e3, name="string")
    scene = sp.Scene(
        [sp.Shell("cloth", surface, CLOTH)], pins=[sp.Pin("cloth", np.flatnonzero(x[:, 0] < -0.0499))], cables=[cable]
    )
    last = checked(scene, 12, tmp_path)
    assert np.ptp(last.positions["cloth"][row, 0]) < 0.085
    assert np.mean(last.report.cables["string"].tension) > 0.1


def test_balloon_in_the_wind_carries_a_block(tmp_path):
    ball = sp.shapes.sphere(radius=0.05, edge_length=0.025).surface.compact()
    rubber = sp.ShellMaterial(youngs=1e6, poisson=0.45, thickness=1e-3, damping=0.01)
    block = sp.RigidBody(
        "block", sp.shapes.box(size=(0.05, 0.02, 0.05)).surface, density=1000.0, position=(0.0, 0.12, 0.0)
    )
    scene = sp.Scene(
        [sp.Shell("balloon", ball, rubber, position=(0.0, 0.0515, 0.0)), block],
        obstacles=[sp.HalfSpace()],
        cavities=[sp.Cavity("balloon", pressure=3000.0)],
        loads=[sp.Wind("balloon", (0.5, 0.0, 0.0))],
    )
    last = checked(scene, 12, tmp_path)
    assert last.report.cavities["balloon"].volume > ball.volume
    assert last.poses["block"].translation[1] > 0.1
    assert last.report.min_distance > 0.0
