"""`supple fit scene.yaml` and `supple check-gradient`: values, files, faults of input, and a fit that was killed."""

import subprocess
import sys
import time

import numpy as np
import pytest

import supple as sp
from supple.app.cli.app import main
from supple.app.cli.console import ExitCode
from supple.app.studies import scene_fit

SCENE = """\
bodies:
  - name: bar
    shape: {kind: box, size: [0.3, 0.05, 0.05], divisions: [4, 1, 1]}
    material: {kind: stable_neo_hookean, youngs: YOUNGS, poisson: 0.4, density: 1000}
    position: [1, 0, 0]
    rotation: [0, 0, 0.3]
pins: [{body: bar, vertices: [0, 1, 2, 3]}]
solver: {kind: implicit, integrator: bdf2, tolerance: 1e-7, contact: null}
dt: 0.01
steps: 9
"""
BLOCK = """\
bodies:
  - name: foam
    shape: {kind: box, size: [0.05, 0.05, 0.05], divisions: [2, 2, 2]}
    material: {kind: neo_hookean, youngs: YOUNGS, poisson: POISSON, density: 60}
pins:
  - {body: foam, box: {low: [-1, -1, -1], high: [1, -0.0249, 1]}}
  - body: foam
    name: plate
    box: {low: [-1, 0.0249, -1], high: [1, 1, 1]}
    motion: {times: [0, 1], displacements: [[0, 0, 0], [0, -0.02, 0]]}
gravity: [0, 0, 0]
solver: {kind: implicit, integrator: static, contact: null}
dt: 0.2
steps: 5
"""
YOUNGS = "bodies.bar.material.youngs=1e4:1e6"


def frames_of(path, text):
    path.write_text(text, encoding="utf-8")
    run = sp.load_run(path)
    return list(sp.simulate(run.scene, run.chosen_solver, run.dt, run.steps))


@pytest.fixture
def film(tmp_path):
    """Of two vertices, in another unit, every second frame."""
    frames = frames_of(tmp_path / "true.yaml", SCENE.replace("YOUNGS", "2e5"))[1::2]
    lines = [
        f"{1e3 * frame.time},{vertex},{','.join(repr(float(1e3 * value)) for value in frame.positions['bar'][vertex])}"
        for frame in frames
        for vertex in (9, 17)
    ]
    (tmp_path / "bar.yaml").write_text(SCENE.replace("YOUNGS", "1e5"), encoding="utf-8")
    (tmp_path / "film.csv").write_text("\n".join(["time [ms],vertex,x [mm],y [mm],z [mm]", *lines, ""]))
    return tmp_path


def fit(folder, *arguments, scene="bar.yaml", data="film.csv", command="fit"):
    output = ["-o", str(folder / "out")] if command == "fit" else []
    return main([command, str(folder / scene), "--data", str(folder / data), *output, *arguments])


def fitted(folder, name):
    material = sp.load_run(folder / "out" / "fitted.yaml").scene.bodies[0].material
    return float(getattr(material, name))


def test_vertices_of_a_film(film, capfd):
    assert fit(film, "--parameters", YOUNGS) == ExitCode.OK
    out = capfd.readouterr().out
    assert "run 1: loss" in out
    assert "bodies.bar.material.youngs = 200000 +- " in out
    assert fitted(film, "youngs") == pytest.approx(2e5, rel=1e-6)
    assert (film / "out" / "fit.png").stat().st_size > 1000
    # The same fit is found in its log; another one has a log of its own.
    assert fit(film, "--parameters", YOUNGS) == ExitCode.OK
    out = capfd.readouterr().out
    assert "goes on from the best one" in out
    assert "run 4" not in out
    assert fit(film, "-p", YOUNGS.replace("youngs", "density").replace("1e4:1e6", "100:5000")) == ExitCode.OK
    assert "goes on" not in capfd.readouterr().out
    assert fitted(film, "density") == pytest.approx(500, rel=1e-6)


def test_check_gradient(film, capfd):
    assert fit(film, "-p", YOUNGS, command="check-gradient") == ExitCode.OK
    assert "gradient and differences agree" in capfd.readouterr().out


def test_named_markers_between_vertices(film):
    """Their first row says where they are; one on the surface may be a little outside of the mesh."""
    scene = sp.load_run(film / "bar.yaml").scene
    body = scene.bodies[0]
    places = np.array([[0.12, 0.01, 0.02], [0.05, -0.0251, 0.0]])
    weights = [sp.Misfit("positions", "bar", np.zeros((2, 3)), points=places)]
    rows = ["time;marker;x;y;z"]
    for frame in sp.simulate(scene, sp.load_run(film / "bar.yaml").chosen_solver, 0.01, 4):
        seen = weights[0].read(frame.system, frame.state)
        rows += [f"{frame.time};{name};{x};{y};{z}" for name, (x, y, z) in zip("ab", seen, strict=True)]
    rows += [f"0;{name};{x};{y};{z}" for name, (x, y, z) in zip("ab", body.place(places), strict=True)]
    (film / "film.csv").write_text("\n".join(rows))
    assert fit(film, "-p", "bodies.bar.material.youngs=1e4:3e5:1e6", scene="true.yaml") == ExitCode.OK
    assert fitted(film, "youngs") == pytest.approx(1e5, rel=1e-6)


def test_a_crush_curve(tmp_path, capfd):
    """In millimetres, with both columns negative, from a machine that also logs other things."""
    frames = frames_of(tmp_path / "true.yaml", BLOCK.replace("YOUNGS", "8e4").replace("POISSON", "0.25"))
    rows = [f"{k},{-4 * (k + 1)},{list(frame.reactions.values())[1][1]}" for k, frame in enumerate(frames)]
    (tmp_path / "curve.csv").write_text("\n".join(["Zwick 7", "Time,Extension [mm],Load [N]", "0,0,0", *rows]))
    (tmp_path / "block.yaml").write_text(BLOCK.replace("YOUNGS", "3e4").replace("POISSON", "0.4"))
    paths = ["bodies.foam.material.youngs=1e3:1e6", "bodies.foam.material.poisson=0.01:0.49"]
    assert fit(tmp_path, "-p", *paths, scene="block.yaml", data="curve.csv") == ExitCode.OK
    assert fitted(tmp_path, "youngs") == pytest.approx(8e4, rel=1e-4)
    assert fitted(tmp_path, "poisson") == pytest.approx(0.25, rel=1e-3)
    assert "+-" in capfd.readouterr().out
    for rows, message in (
        ("0,0\n10,2\n5,1\n20,4\n", "curve.csv:4: the displacement goes back; keep the rows of one loading"),
        ("0,0\n30,2\n", "its displacements, up to 0.03 m, are those of no frame, which go up to 0.02 m"),
    ):
        (tmp_path / "curve.csv").write_text("Extension [mm],Load [N]\n" + rows)
        assert fit(tmp_path, "-p", *paths, scene="block.yaml", data="curve.csv") == ExitCode.INPUT
        assert message in capfd.readouterr().err


def test_a_press_of_obstacles_with_friction(tmp_path):
    """A file that leaves the solver to the scene; the only obstacle that moves has the force."""
    text = (
        BLOCK.replace("YOUNGS", "4e4").replace("POISSON", "0.3").replace("divisions: [2, 2, 2]", "divisions: [1, 1, 1]")
    )
    plates = """obstacles:
  - {kind: half_space, name: table, point: [0, -0.0251, 0], friction: 0.3}
  - kind: half_space
    name: plate
    point: [0, 0.0251, 0]
    normal: [0, -1, 0]
    friction: 0.3
    motion: {times: [0, 1], displacements: [[0, 0, 0], [0, -0.02, 0]]}
"""
    text = (
        text[: text.index("pins:")]
        + plates
        + text[text.index("gravity:") : text.index("solver:")]
        + "dt: 0.2\nsteps: 2\n"
    )
    (tmp_path / "press.yaml").write_text(text)
    scene, solver = sp.load_scene(tmp_path / "press.yaml"), scene_fit.FITTED_WITH
    force = [frame.sensors["plate"].force[1] for frame in sp.simulate(scene, solver, 0.2, 2)]
    rows = [f"{0.004 * (k + 1)};{2 * value}" for k, value in enumerate(force)]
    (tmp_path / "curve.csv").write_text("\n".join(["displacement;force", "0;0", *rows]))
    youngs = "bodies.foam.material.youngs=1e4:1e6"
    assert fit(tmp_path, "-p", youngs, scene="press.yaml", data="curve.csv") == ExitCode.OK
    assert fitted(tmp_path, "youngs") == pytest.approx(8e4, rel=0.02)  # without inertia, forces are as moduli


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (
            "time,vertex,x,y\n0,1,0,0\n",
            "has the columns time, vertex, x, y; name them time, vertex or marker, x, y and z",
        ),
        ("time,vertex,x [furlong],y,z\n.01,1,0,0,0\n", "the column x has the unit 'furlong'; give one of m, cm"),
        ("time,vertex,x,y,z\n.01,1,0,zero,0\n", "film.csv:2: has no number in the column y"),
        ("time,vertex,x,y,z\n.01,77,0,0,0\n", "film.csv:2: body 'bar' has vertices 0 to 19"),
        ("time,vertex,x,y,z\n.5,7,0,0,0\n", "have no frame of the run"),
        ("time,marker,x,y,z\n.01,nose,0,0,0\n", "marker 'nose' has no row at time 0"),
        ("time,marker,x,y,z\n0,nose,1,0.2,0\n", "marker 'nose' is 0.18 m outside of body 'bar' at time 0"),
        ("time,vertex,x,y,z\n", "film.csv: has no rows"),
        ("displacement,force\n0,0\n1,1\n", "the force of which pin or obstacle is it"),
    ],
)
def test_faults_of_data(film, capfd, rows, message):
    (film / "film.csv").write_text(rows)
    assert fit(film, "-p", YOUNGS) == ExitCode.INPUT
    err = capfd.readouterr().err
    assert message in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-p", "bodies.bar.material.young=1e4:1e6"], "young"),
        (["-p", "bodies.bear.material.youngs=1e4:1e6"], "bodies has no entry 'bear'; did you mean 'bar'?"),
        (["-p", "bodies.bar.material.youngs"], "give PATH=LOW:HIGH"),
        (["-p", "bodies.bar.material.youngs=1e6:1e4"], "give PATH=LOW:HIGH"),
        (["-p", "bodies.bar.material.youngs=2e5:1e6"], "its value 100000 in"),
        (["-p", "bodies.bar.material.youngs=-5:1e6"], "youngs"),
        (["-p", "bodies.bar.material.damping=0:1"], "has no value; give bodies.bar.material.damping=LOW:START:HIGH"),
        (["-p", "bodies.bar.name=0:1"], "name"),
        (["-p", "dt=0.01:0.1"], "dt is not a part of the scene"),
        (["-p", "solver.tolerance=1e-9:1"], "solver.tolerance is not a part of the scene"),
        (["-p", "gravity.1=-20:0"], "has no gravity; write it there"),
        (["-p", YOUNGS, YOUNGS], "each path once"),
        ([], "give --parameters"),
        (["-p", YOUNGS, "--of", "bear"], "body 'bear' does not exist; give --of, did you mean 'bar'?"),
        (["-p", YOUNGS, "--area", "1"], "--area is for a fit of rubber"),
    ],
)
def test_faults_of_arguments(film, capfd, arguments, message):
    assert fit(film, *arguments) == ExitCode.INPUT
    err = capfd.readouterr().err
    assert message in err
    assert err.count("\n") == 1
    assert not (film / "out").exists()


def test_a_solver_without_derivatives(film, capfd):
    text = (film / "bar.yaml").read_text()
    solver = text[text.index("solver:") : text.index("dt:")]
    (film / "bar.yaml").write_text(text.replace(solver, "solver: {kind: xpbd}\n"))
    assert fit(film, "-p", YOUNGS) == ExitCode.INPUT
    assert "give solver: {kind: implicit}" in capfd.readouterr().err


def test_a_fit_that_is_killed_goes_on(film, capfd):
    """The second process begins from the best run of the first, also where that has left a part of a line."""
    command = ["fit", str(film / "bar.yaml"), "-p", YOUNGS, "--data", str(film / "film.csv"), "-o", str(film / "out")]
    process = subprocess.Popen([sys.executable, "-m", "supple", *command], stdout=subprocess.DEVNULL)
    deadline = time.monotonic() + 120
    while not (logs := list((film / "out").glob("runs-*.csv"))) or logs[0].read_text().count("\n") < 3:
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.01)
    process.kill()
    process.wait()
    whole = logs[0].read_text()
    logs[0].write_text(whole[: whole.rfind("\n") + 1] + "0.0000")
    known = [float(line.split(",")[0]) for line in whole.splitlines()[1:]]
    assert main(command) == ExitCode.OK
    first, second = capfd.readouterr().out.splitlines()[:2]
    assert "goes on from the best one" in first
    assert float(second.split("loss ")[1].split(";")[0]) == pytest.approx(min(known), rel=1e-4)
    assert fitted(film, "youngs") == pytest.approx(2e5, rel=1e-6)
