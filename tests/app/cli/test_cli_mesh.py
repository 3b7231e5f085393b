"""`supple mesh`: files in, files out, and errors as one line with exit code 2."""

from pathlib import Path

import numpy as np
import pytest

from supple.app.cli.app import main
from supple.mesh.primitives.surfaces import sphere_surface
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh

BALL = sphere_surface(radius=0.5, edge_length=0.25)


@pytest.fixture
def ball(tmp_path: Path) -> Path:
    BALL.save(tmp_path / "ball.stl")
    return tmp_path / "ball.stl"


@pytest.mark.parametrize("name", ["ball.1.node", "ball.1.face", "ball.msh", "ball.vtu", "ball.vtk"])
def test_every_kind_of_output_reads_back(ball: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    output = ball.with_name(name)
    assert main(["mesh", str(ball), "-o", str(output), "--max-volume", "5e-3"]) == 0
    mesh = TetMesh.load(output)
    assert mesh.volume == pytest.approx(BALL.volume, rel=1e-4)
    assert mesh.volumes.max() <= 5e-3 * (1 + 1e-6)
    output = capsys.readouterr().out
    assert "tetgen" in output
    assert str(len(mesh.tets)) in output
    quartet = {f"ball.1.{s}" for s in ("node", "ele", "edge", "face")}
    assert {p.name for p in ball.parent.iterdir()} == {ball.name} | (quartet if ".1." in name else {name})


def test_without_an_output_the_mesh_has_the_name_of_the_surface(
    ball: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    assert main(["mesh", str(ball), "--max-volume", "0.1"]) == 0
    assert TetMesh.load(elsewhere / "ball.vtu").volume == pytest.approx(BALL.volume, rel=1e-4)


@pytest.mark.parametrize(("options", "count"), [([], 2_000), (["--tets", "900"], 900)])
def test_the_number_of_tets_is_as_asked_or_two_thousand(ball: Path, options: list[str], count: int) -> None:
    assert main(["mesh", str(ball), "-o", str(ball.with_name("b.vtu")), *options]) == 0
    assert len(TetMesh.load(ball.with_name("b.vtu")).tets) == pytest.approx(count, rel=0.1)


def test_tets_have_edges_of_the_length_asked(ball: Path) -> None:
    assert main(["mesh", str(ball), "-o", str(ball.with_name("b.vtu")), "--edge", "0.1"]) == 0
    mesh = TetMesh.load(ball.with_name("b.vtu"))
    edges = mesh.vertices[mesh.edges]
    assert 0.07 < np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1).mean() < 0.11


def test_a_file_in_millimetres_is_named_and_scaled(ball: Path, caplog: pytest.LogCaptureFixture) -> None:
    SurfaceMesh(30 * BALL.vertices, BALL.triangles).save(ball)
    command = ["mesh", str(ball), "-o", str(ball.with_name("b.vtu")), "--tets", "500"]
    assert main(command) == 0
    assert " m long; where it is in millimetres, give --scale 0.001" in caplog.text
    caplog.clear()
    assert main([*command, "--scale", "0.001"]) == 0
    assert "millimetres" not in caplog.text
    assert np.ptp(TetMesh.load(ball.with_name("b.vtu")).vertices) == pytest.approx(0.03, rel=0.05)


def test_base_index_and_options_reach_the_mesher(ball: Path) -> None:
    options = ["--base-index", "0", "--keep-surface", "--quality", "1.2", "--min-dihedral", "10"]
    assert main(["mesh", str(ball), "--output", str(ball.with_name("b.node")), *options]) == 0
    assert ball.with_name("b.node").read_text().splitlines()[1].startswith("0 ")
    mesh = TetMesh.load(ball.with_name("b.ele"))
    assert len(mesh.surface.used_vertices) == len(BALL.vertices)


def test_repair_is_reported(ball: Path, capsys: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture) -> None:
    turned = np.vstack([BALL.triangles[:9, ::-1], BALL.triangles[9:]])
    SurfaceMesh(BALL.vertices, turned).save(ball)
    assert main(["mesh", str(ball), "-o", str(ball.with_name("b.vtu")), "--mesher", "tetgen"]) == 0
    assert "reoriented 9 triangles to agree with their neighbours" in caplog.text
    SurfaceMesh(BALL.vertices, BALL.triangles[1:]).save(ball)
    assert main(["mesh", str(ball), "-o", str(ball.with_name("b.vtu")), "--mesher", "tetgen"]) == 2
    assert "open boundary edge" in capsys.readouterr().err
    assert main(["mesh", str(ball), "-o", str(ball.with_name("b.vtu")), "--repair"]) == 0
    assert "closed 1 hole" in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["missing.stl", "-o", "b.node"], "missing.stl: "),
        (["ball.stl", "-o", "b.step"], "b.step: the extension must be one of .node"),
        (["ball.stl", "-o", "no/where/b.msh"], "does not exist"),
        (["ball.stl", "-o", "used.1.node"], "used.1.face: is a folder"),
        (["ball.stl", "-o", "b.node", "--quality", "0.9"], "ball.stl: --quality must be"),
        (["ball.stl", "-o", "b.node", "--max-volume", "-1"], "--max-volume must be"),
        (["ball.stl", "-o", "b.node", "--tets", "0"], "tets must be"),
        (["ball.stl", "-o", "b.node", "--edge", "nan"], "edge must be"),
        (
            ["ball.stl", "-o", "b.node", "--edge", "0.1", "--tets", "9"],
            "give only one of --max-volume, --edge and --tets",
        ),
        (["ball.stl", "-o", "b.node", "--scale", "0"], "scale must be"),
        (["ball.stl", "-o", "b.node", "--memory-limit", "0"], "memory limit must be"),
        (["ball.stl", "-o", "b.node", "--time-limit", "nan"], "--time-limit must be"),
        (["ball.stl", "-o", "b.node", "--max-volume", "3e-6", "--time-limit", "0.5"], "time limit of 0.5 s"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_errors_are_one_line_and_leave_no_file(ball: Path, monkeypatch, capsys, arguments, message) -> None:
    monkeypatch.chdir(ball.parent)
    Path("used.1.face").mkdir()
    assert main(["mesh", *arguments]) == 2
    output = capsys.readouterr().err
    assert message in output
    assert output.count("\n") == 1
    assert {p.name for p in ball.parent.iterdir()} == {"ball.stl", "used.1.face"}
