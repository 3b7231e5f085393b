"""A surface file is a scene: a body above a floor, of a sensible size, material and number of tets."""

import logging
import re
from pathlib import Path

import numpy as np
import pytest

import supple as sp
from supple.app.cli.app import main
from supple.app.scene_file.loader import load_run

BALL = sp.shapes.sphere_surface(0.05, 0.004)
HALF_TURN = np.array([[-1.0, 0, 0], [0, 1, 0], [0, 0, -1]])


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_a_fine_surface_in_millimetres_away_from_the_origin(caplog):
    BALL.transformed(1000.0, HALF_TURN, (300.0, -200.0, 50.0)).save("part.stl")
    with caplog.at_level(logging.INFO):
        run = load_run("part.stl")
    (body,) = run.scene.bodies
    assert body.name == "part"
    assert len(body.mesh.tets) == pytest.approx(2000, rel=0.1)
    assert body.mesh.volume == pytest.approx(BALL.volume, rel=0.02)
    assert body.skin is not None
    assert len(body.skin.triangles) == len(BALL.triangles)
    placed = body.place(body.mesh.vertices)
    low, high = placed.min(axis=0), placed.max(axis=0)
    assert low[1] == pytest.approx(0.1 * 0.1, rel=0.05)
    assert np.abs(0.5 * (low + high)[[0, 2]]).max() < 1e-3
    assert [type(obstacle).__name__ for obstacle in run.scene.obstacles] == ["HalfSpace"]
    said = [record.getMessage() for record in caplog.records]
    assert any("taken to be in millimetres (scale: 0.001)" in text and "about 2,000 tets" in text for text in said)
    assert any(f"its {len(BALL.triangles)} triangles are drawn" in text for text in said)
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]


@pytest.mark.parametrize(("size", "youngs"), [(0.1, 5e4), (2.0, 4e5)])
def test_large_bodies_are_stiff_enough_to_stand(size, youngs):
    sp.shapes.box_surface((size, size, size), (4, 4, 4)).save("part.stl")
    assert load_run("part.stl").scene.bodies[0].material.youngs == youngs


def test_an_open_surface_is_closed():
    middle = BALL.vertices[BALL.triangles].mean(axis=1)
    sp.SurfaceMesh(BALL.vertices, BALL.triangles[middle[:, 1] < 0.045]).compact().save("part.stl")
    assert "repair: true" in load_run("part.stl").text
    assert len(load_run("part.stl").scene.bodies[0].mesh.tets) == pytest.approx(2000, rel=0.1)


def test_a_scene_without_a_size_has_no_more_tets_than_by_default(caplog):
    BALL.save("part.stl")
    with open("a.yaml", "w", encoding="utf-8") as file:
        file.write("bodies: [{name: a, mesh: {file: part.stl}, material: {kind: arap, youngs: 1e5, poisson: 0.3}}]")
    (body,) = sp.load_scene("a.yaml").bodies
    assert len(body.mesh.tets) == pytest.approx(2000, rel=0.1)
    assert body.skin is not None


def test_a_large_mesh_in_a_scene_is_most_likely_in_millimetres(caplog):
    sp.shapes.box((119.0, 20.0, 20.0), (6, 1, 1)).save("part.vtu")
    scene = "bodies: [{name: a, mesh: {file: part.vtu, scale: SCALE}, material: {kind: arap, youngs: 1e5, poisson: 0}}]"
    for scale, warned in ((1, True), (0.001, False)):
        caplog.clear()
        with open("a.yaml", "w", encoding="utf-8") as file:
            file.write(scene.replace("SCALE", str(scale)))
        sp.load_scene("a.yaml")
        assert ("part.vtu is 119 m long; where it is in millimetres, give scale: 0.001" in caplog.text) == warned


def test_a_surface_is_simulated_and_resumed(tmp_path, capsys):
    sp.shapes.box_surface((100.0, 100.0, 100.0), (3, 3, 3)).save("part.stl")
    assert main(["run", "part.stl", "-o", "out/part", "--steps", "2", "--no-page", "--no-plot"]) == 0
    assert "2 frames" in capsys.readouterr().out
    with sp.read_recording("out/part/recording.vtkhdf") as recording:
        assert len(recording) == 3
        assert np.ptp(recording.rest_positions, axis=0).max() == pytest.approx(0.1, rel=0.01)
    assert main(["resume", "out/part", "--steps", "3"]) == 0


def test_errors_name_the_surface(capsys):
    sp.SurfaceMesh(np.eye(3), [[0, 1, 2]]).save("part.stl")
    assert main(["run", "part.stl"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("supple: part.stl: ")
    assert main(["run", "missing.stl"]) == 2
    assert "missing.stl" in capsys.readouterr().err


CLOTH = sp.shapes.sheet(0.4, 0.3, 0.05)


@pytest.mark.parametrize("factor", [1.0, 1000.0])
def test_an_open_surface_is_a_shell_above_a_floor(caplog, factor):
    CLOTH.transformed(factor, HALF_TURN, (30.0, -2.0, 5.0)).save("cloth.obj")
    with caplog.at_level(logging.INFO):
        run = load_run("cloth.obj", shell=True)
    (body,) = run.scene.bodies
    assert isinstance(body, sp.Shell)
    assert body.surface.area == pytest.approx(0.12)
    assert body.material.thickness == 0.002
    x = body.place(body.points)
    assert np.allclose(x.mean(axis=0), [0.0, 0.04, 0.0], atol=2e-3)
    assert "a shell of 96 triangles" in caplog.text
    assert "--surface cloth.obj --shell" in caplog.text
    *_, frame = sp.simulate(run.scene, run.solver, run.dt, 8)
    assert frame.report.status == "converged"
    assert 0.001 < frame.positions["cloth"][:, 1].min() < 0.04
    # It stretches by less than a hundredth where it hangs.
    assert body.material.density * 9.81 * 0.4 / body.material.youngs < 0.011


def test_a_fine_shell_is_thinner_than_its_edges():
    sp.shapes.sheet(0.4, 0.1, 0.002).transformed(1000.0).save("fine.obj")
    (body,) = load_run("fine.obj", shell=True).scene.bodies
    assert isinstance(body, sp.Shell)
    assert body.material.thickness == 0.001


def _broken(name):
    x, triangles = CLOTH.vertices, CLOTH.triangles
    if name == "turned":
        return sp.SurfaceMesh(x, np.concatenate([triangles[:1, ::-1], triangles[1:]]))
    if name == "three":
        wing = [triangles[0, 0], triangles[0, 1], len(x)]
        return sp.SurfaceMesh(
            np.concatenate([x, x[:1] + np.array([0.0, 0.1, 0.0])]), np.concatenate([triangles, [wing]])
        )
    return sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1))


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("turned.obj", "turned.obj: as a shell, the edge of vertices .* has two triangles that face different ways"),
        ("three.obj", "three.obj: as a shell, the edge of vertices .* (more than two triangles|face different ways)"),
        ("tets.vtu", "tets.vtu: as a shell, it needs a surface, and this is a mesh of tets; give a file of triangles"),
        ("scene.yaml", "scene.yaml: `shell` is of a file of a surface; a body of a scene file has `shell: {...}`"),
    ],
)
def test_what_cannot_be_a_shell_is_one_line_in_its_words(name, message, capfd):
    if name == "scene.yaml":
        Path(name).write_text("bodies: []", encoding="utf-8")
    else:
        _broken(name.partition(".")[0]).save(name)
    for command in ("run", "view"):
        assert main([command, name, "--shell", *["--no-open"] * (command == "view")]) == 2
        assert re.search(message.replace("{...}", r"\{\.\.\.\}"), " ".join(capfd.readouterr().err.split()))
