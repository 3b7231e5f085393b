"""`supple new` writes scene files that load, and simulate."""

import numpy as np
import pytest

import supple as sp
from supple.app.cli.app import main


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_a_new_scene_has_comments_and_is_simulated(capsys):
    assert main(["new"]) == 0
    assert "wrote scene.yaml" in capsys.readouterr().out
    with open("scene.yaml", encoding="utf-8") as file:
        text = file.read()
    assert text.count("#") > 15
    run = sp.load_run("scene.yaml")
    *_, frame = sp.simulate(run.scene, run.solver, run.dt, 3)
    assert frame.report.status == "converged"
    uncommented = text.replace("# pins:", "pins:").replace("\n#   ", "\n  ")
    with open("pinned.yaml", "w", encoding="utf-8") as file:
        file.write(uncommented[uncommented.index("bodies:") :])
    assert len(sp.load_scene("pinned.yaml").pins) == 1, "the parts in comments are valid, too"


@pytest.mark.parametrize(("factor", "scale"), [(1.0, 1.0), (1000.0, 0.001)])
def test_a_surface_becomes_the_body_in_metres(tmp_path, capsys, factor, scale):
    ball = sp.shapes.sphere_surface(0.1, 0.05)
    (tmp_path / "my parts").mkdir()
    sp.SurfaceMesh(factor * ball.vertices, ball.triangles).save("my parts/bouncy ball.stl")
    assert main(["new", "b.yaml", "--surface", "my parts/bouncy ball.stl"]) == 0
    assert ("millimetres" in capsys.readouterr().out) == (scale != 1.0)
    scene = sp.load_scene("b.yaml")
    assert scene.bodies[0].name == "bouncy_ball"
    assert scene.bodies[0].mesh.volume == pytest.approx(ball.volume, rel=1e-3)
    body = scene.bodies[0]
    lowest = body.place(body.mesh.vertices)[:, 1].min()
    assert lowest == pytest.approx(0.1 * np.ptp(ball.vertices, axis=0).max(), rel=0.01), "above the floor"
    assert len(scene.bodies[0].mesh.tets) == pytest.approx(2000, rel=0.1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["old.yaml"], "old.yaml: exists already; give another name, or --overwrite"),
        (["ball.stl"], "is a mesh, not a scene file; give it as supple new --surface ball.stl"),
        (["scene.json"], "a scene file ends in .yaml"),
        (["no/where.yaml"], "does not exist"),
        (["--scale", "2"], "give --surface, too"),
        (["--shell"], "--shell is of a surface; give --surface, too"),
        (["--surface", "missing.stl"], "missing.stl: "),
        (["--surface", "ball.stl", "--scale", "-1"], "scale must be"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_errors_are_one_line(tmp_path, capsys, arguments, message):
    (tmp_path / "old.yaml").write_text("mine")
    sp.shapes.sphere_surface(0.1, 0.1).save("ball.stl")
    assert main(["new", *arguments]) == 2
    said = capsys.readouterr().err
    assert message in said
    assert said.count("\n") == 1
    assert (tmp_path / "old.yaml").read_text() == "mine"
    assert main(["new", "old.yaml", "--overwrite"]) == 0
