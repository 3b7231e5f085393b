"""Output paths: commands never replace their input, and check the output path before a simulation."""

import pytest

import supple as sp
from supple.app.cli.app import main
from supple.app.cli.console import ExitCode

SCENE = """\
bodies:
  - name: cube
    shape: {kind: box, divisions: [1, 1, 1]}
    material: {kind: stable_neo_hookean, youngs: 1e5, poisson: 0.4}
solver: {kind: implicit}
steps: 2
"""


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder, the current one, with a scene, a surface, and a recording."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.yaml").write_text(SCENE)
    cube = sp.shapes.box((1, 1, 1), (1, 1, 1))
    cube.surface.save(tmp_path / "cube.vtk")
    body = sp.Body("cube", cube, sp.StableNeoHookean(youngs=1e5, poisson=0.4))
    list(sp.simulate(sp.Scene([body]), sp.XPBD(), 0.01, 2, sinks=[sp.Recorder(tmp_path / "r.vtkhdf")]))
    (tmp_path / "link.svg").symlink_to("r.vtkhdf")
    return tmp_path


def contents(place):
    return {path: path.read_bytes() for path in place.rglob("*") if path.is_file()}


@pytest.mark.parametrize(
    "arguments",
    [
        ["check", "r.vtkhdf", "--json", "r.vtkhdf"],
        ["export", "r.vtkhdf", "--to", "vtkhdf", "-o", "r.vtkhdf"],
        ["plot", "r.vtkhdf", "-o", "link.svg"],
        ["mesh", "cube.vtk", "-o", "cube.vtk"],
    ],
    ids=lambda arguments: arguments[0],
)
def test_an_input_file_is_not_replaced(place, capsys, arguments):
    before = contents(place)
    assert main(arguments) == ExitCode.INPUT
    error = capsys.readouterr().err
    assert "itself, which is read; give another name" in error
    assert error.count("\n") == 1
    assert contents(place) == before


@pytest.mark.parametrize("arguments", [["check"], ["plot"], ["export", "--to", "obj"]], ids=lambda some: some[0])
def test_the_folder_of_a_run_stands_for_its_recording(place, capsys, arguments):
    (place / "out").mkdir()
    assert main([*arguments, "out"]) == ExitCode.INPUT
    error = capsys.readouterr().err
    assert error.startswith("supple: out")
    assert "recording.vtkhdf" in error
    (place / "r.vtkhdf").rename(place / "out" / "recording.vtkhdf")
    assert main([*arguments, "out"]) == ExitCode.OK
    assert {path.name for path in (place / "out").iterdir()} >= {
        "check": {"recording.vtkhdf"},
        "plot": {"plot.png"},
        "export": {"recording_obj"},
    }[arguments[0]]


def test_a_format_is_not_written_under_the_suffix_of_another(place, capsys):
    before = contents(place)
    assert main(["export", "r.vtkhdf", "--to", "glb", "-o", "x.obj"]) == ExitCode.INPUT
    assert capsys.readouterr().err == (
        "supple: x.obj: a file in format glb must end in .glb; name it x.glb, or choose another format\n"
    )
    assert contents(place) == before


@pytest.mark.parametrize(
    ("existing", "message"),
    [
        (
            "out/index.html/",
            "out/index.html: this is a folder, and a file of that name must be written; choose another --output",
        ),
        (
            "out/plot.png/",
            "out/plot.png: this is a folder, and a file of that name must be written; choose another --output",
        ),
        ("out/recording.vtkhdf/", "out/recording.vtkhdf: is a folder"),
        ("out", "out: is not a folder, and must be one to hold recording.vtkhdf; give another"),
    ],
)
def test_an_output_path_in_use_is_reported_before_the_simulation(place, capsys, existing, message):
    if existing.endswith("/"):
        (place / existing).mkdir(parents=True)
    else:
        (place / existing).write_text("mine")
    before = contents(place)
    assert main(["run", "scene.yaml", "-o", "out"]) == ExitCode.INPUT
    assert f"supple: {message}" in capsys.readouterr().err
    assert contents(place) == before


def test_names_may_hold_spaces_and_any_letters(place, capsys):
    folder = place / "ü b" / "日本"
    assert main(["run", "scene.yaml", "-o", str(folder), "-q"]) == ExitCode.OK
    assert {path.name for path in folder.iterdir()} >= {"recording.vtkhdf"}
    assert (
        main(["export", str(folder / "recording.vtkhdf"), "--to", "glb", "-o", str(folder / "ñ a.glb")]) == ExitCode.OK
    )
    assert (folder / "ñ a.glb").read_bytes()[:4] == b"glTF"
