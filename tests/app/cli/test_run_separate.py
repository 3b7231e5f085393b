"""`supple run --separate`: prints the moves, records the moved scene, and fails where it cannot separate bodies."""

import pytest

from supple.app.cli.app import main
from supple.app.cli.console import ExitCode
from supple.results.recording.reader import read_recording

CUBE = "shape: {kind: box, divisions: [2, 2, 2]}, material: {kind: stable_neo_hookean, youngs: 1e5, poisson: 0.3}"


@pytest.fixture
def scene(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def write(height, solver="xpbd"):
        text = f"""bodies:
  - {{name: low, position: [0, 0.6, 0], {CUBE}}}
  - {{name: high, position: [0, {height}, 0], {CUBE}}}
gravity: [0, 0, 0]
solver: {{kind: {solver}}}
dt: 0.01
steps: 1
"""
        (tmp_path / "scene.yaml").write_text(text)
        return text

    return write


@pytest.mark.parametrize("solver", ["xpbd", "implicit"])
def test_overlapping_cubes_are_moved_apart_and_recorded(scene, capfd, solver):
    text = scene(1.5, solver)
    command = ["run", "scene.yaml", "--no-page", "--no-plot", "--quiet"]
    assert main([*command, "--separate"]) == ExitCode.OK
    out, _ = capfd.readouterr()
    assert out.startswith("moved body 'high' by (0, 0.10569, 0) m")
    with read_recording("out/recording.vtkhdf") as recording:
        y = recording[0].positions
        assert y["high"][:, 1].min() - y["low"][:, 1].max() == pytest.approx(0.0056904, rel=1e-3)
        assert recording.scene_text is not None
        assert recording.scene_text.startswith(text)
        assert "# supple run --separate moved body 'high' by (0, 0.10569, 0) m" in recording.scene_text


def test_no_move_is_reported(scene, capfd):
    text = scene(2.0)
    assert main(["run", "scene.yaml", "--no-page", "--no-plot", "-q", "--separate"]) == ExitCode.OK
    assert capfd.readouterr().out == "nothing was moved: no surfaces intersect\n"
    with read_recording("out/recording.vtkhdf") as recording:
        assert recording.scene_text == text


def test_a_scene_that_cannot_be_separated_is_an_input_error(scene, capfd, tmp_path):
    scene(0.6)
    assert main(["run", "scene.yaml", "--separate"]) == ExitCode.INPUT
    _, err = capfd.readouterr()
    assert err.startswith("supple: body 'low' overlaps body 'high' at the start (triangles ")
    assert "cannot be separated by a small translation" in err
    assert not (tmp_path / "out").exists()
