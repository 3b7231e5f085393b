"""`check_recording` on good recordings: settings, results, and the shell."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from tests.recordings import remove_from_scene, set_in_scene

import supple as sp
from supple.app.cli.app import main
from supple.errors import OutputError
from supple.results import check as check_package
from supple.results.check.settings import NAMES

from .conftest import FRAMES, JELLY, failures, nan_position, recorded, verdicts


def test_a_good_recording_passes_everything_that_can_be_checked(free, around):
    assert verdicts(free) == {
        name: "skipped" if name in ("cells", "obstacles", "rigidity", "welds", "joints", "works") else "pass"
        for name in NAMES
    }
    why_not = dict.fromkeys(("cells", "momentum", "spin", "rigidity", "welds", "joints", "works"), "skipped")
    assert verdicts(around) == {name: why_not.get(name, "pass") for name in NAMES}
    report = sp.check_recording(around)
    assert (report.frames, report.frames_checked) == (FRAMES, FRAMES)
    assert (report["intersection"].worst, report["intersection"].frame) == (0.0, None)
    # The cube falls a few centimetres; the ball is nearest to it at the start, or the floor later.
    assert 0.0 < report["distance"].worst < 1.0
    assert report["inversion"].worst == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("integrator", ["backward_euler", "bdf2", "newmark"])
def test_implicit_recordings_pass(tmp_path, integrator):
    block = sp.shapes.box((1.0, 0.5, 0.5), (2, 1, 1))
    solver = sp.Implicit(integrator=integrator)
    scene = sp.Scene([sp.Body("block", block, JELLY, angular_velocity=(0, 3, 1))])
    path = recorded(tmp_path / "r.vtkhdf", scene, solver, initial_positions={"block": block.vertices * [0.9, 1.05, 1]})
    found = verdicts(path, skip=["cells", "obstacles", "rigidity", "welds", "joints", "works"])
    assert set(found.values()) == {"pass"}


def test_bodies_of_edges_and_volumes_pass(tmp_path):
    scene = sp.Scene(
        [
            sp.Body(
                "net",
                sp.shapes.box((1, 1, 1), (2, 2, 2)),
                sp.EdgesAndVolume(edge_compliance=1e-4, volume_compliance=1e-6),
            )
        ]
    )
    start = {"net": scene.bodies[0].mesh.vertices * [0.9, 1, 1]}
    path = recorded(tmp_path / "r.vtkhdf", scene, sp.XPBD(substeps=5), initial_positions=start)
    assert failures(path) == {}
    assert sp.check_recording(path)["records"].worst < 1e-12


def test_without_works_energy_is_judged_only_where_nothing_does_work(free, around, corrupted):
    def forget(file, n):
        with_work = json.loads(file["supple/header"][()])["fields"]["details"]["fields"]["fields"]["tuple"]
        number = next(k for k, field in enumerate(with_work) if field["fields"]["name"] == "work")
        remove_from_scene(file, f"details/fields/{number}")

    assert verdicts(corrupted(free, forget), only=["energy", "balance"]) == {"energy": "pass", "balance": "skipped"}
    report = sp.check_recording(corrupted(around, forget), only=["energy"])
    assert report["energy"].message == "obstacles move, which does work"


@pytest.mark.parametrize(
    ("where", "value", "message"),
    [
        ("scene", None, "scene is 'None', not of the type Scene"),
        ("scene/contact_pairs", 3, "contact_pairs is 3; give a list"),
        ("scene/contact_pairs", ("left",), r"contact_pairs\[0\] is a str; give a ContactPair"),
        ("scene/bodies/0/material", None, "material is None; give a material"),
        ("scene/bodies/0/material/youngs", -1.0, "youngs is -1; it must be above zero"),
    ],
)
def test_an_inconsistent_description_is_an_error(free, corrupted, where, value, message):
    with pytest.raises(OutputError, match=message):
        sp.check_recording(corrupted(free, lambda file, n: set_in_scene(file, where, value)))


def test_every_kth_frame_and_the_last(free, corrupted):
    path = corrupted(free, nan_position)
    report = sp.check_recording(path, every=4)
    assert (report.frames, report.frames_checked, report.ok) == (FRAMES, 3, True)
    assert failures(path, every=3) == {"finite": 3}
    seen = []
    sp.check_recording(path, every=4, only=["finite"], progress=lambda *done: seen.append(done))
    assert seen == [(1, 3), (2, 3), (3, 3)]


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"only": ["inversions"]}, "check 'inversions' does not exist"),
        ({"skip": list(NAMES)}, "nothing is left"),
        ({"every": 0}, "every is 0"),
        ({"max_energy_gain": -1.0}, "max_energy_gain is -1"),
    ],
)
def test_invalid_settings(settings, message):
    with pytest.raises(OutputError, match=message):
        sp.check_recording("missing.vtkhdf", **settings)


def test_the_shell(free, corrupted, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")
    assert main(["check", str(free), "--json", str(tmp_path / "out" / "r.json")]) == 0
    out = capsys.readouterr().out
    assert all(name in out for name in NAMES)
    content = json.loads((tmp_path / "out" / "r.json").read_text())
    assert content["ok"] is True
    assert [result["name"] for result in content["results"]] == list(NAMES)
    path = str(corrupted(free, nan_position))
    assert main(["check", path]) == 1
    assert "fail" in capsys.readouterr().out
    assert main(["check", path, "--skip", "finite"]) == 0
    assert main(["check", path, "--only", "finite", "--only", "status", "--quiet"]) == 1
    out = capsys.readouterr().out
    assert "status" not in out.split("verdict")[-1]
    assert main(["check", str(free), "-q"]) == 0
    assert capsys.readouterr() == ("", "")


def test_files_that_cannot_be_checked(free, tmp_path, capsys):
    short = tmp_path / "short.vtkhdf"
    short.write_bytes(free.read_bytes()[:20_000])
    other = tmp_path / "other.vtkhdf"
    other.write_text("no HDF5")
    for arguments in (
        [str(short)],
        [str(other)],
        [str(tmp_path / "none.vtkhdf")],
        [str(free), "--only", "nonsense"],
        [str(free), "--every", "1.5"],
    ):
        assert main(["check", *arguments]) == 2
        out, err = capsys.readouterr()
        assert out == ""
        assert err.startswith("supple: ")
        assert err.count("\n") == 1


def test_the_checker_shares_no_code_with_the_solvers():
    code = (
        "import sys, supple.results.check.checker, supple.app.cli.commands.check, supple.results.check.shown\n"
        "print([n for n in sys.modules if n.startswith(('supple.solvers', 'supple.contact', 'supple.numerics.cubic',"
        " 'supple.mesh.surface_checks', 'ipctk'))])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=100)
    assert done.stdout.strip() == "[]", done
    own = Path(check_package.__file__).parent
    known = re.compile(
        r"supple\.(results|errors|model\.state|materials|kinds|runtime|scene|mesh\.(io|topology|skin))\b"
    )
    for path in own.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"\.(records|source|recording)\.system\b", text), f"{path.name} reads a solver's arrays"
        for name in re.findall(r"^\s*(?:from|import) (supple[\w.]*)", text, flags=re.M):
            assert known.match(name), f"{path.name} imports {name}"
