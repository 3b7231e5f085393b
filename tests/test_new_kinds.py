"""A new kind of each thing, as somebody outside of Supple would add it: in at most three files' worth of code.

Each works in scene files and their schema, in both solvers, in recordings, checks and pages, and in `supple info`.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import h5py
import numpy as np
import pytest
from jsonschema import Draft202012Validator
from tests.scene.test_new_kind_of_obstacle import RoundedCube

import supple as sp
from supple.app.cli.app import COMMANDS, app, main
from supple.app.cli.app import register as register_command
from supple.app.scene_file.document import json_schema
from supple.app.scene_file.loader import load_run
from supple.app.scene_file.yaml_files import read_yaml
from supple.kinds.validators import ANY_NUMBER, POSITIVE, BodyName, Name, NumberPerTet, Vector
from supple.materials.by_law import ByLaw
from supple.materials.per_tet import Law
from supple.materials.registry import MATERIALS
from supple.mesh.primitives.shape import SHAPES, shape
from supple.model.joints.functions import FORMS, Form, Values
from supple.model.loads.applied import AppliedLoad, DeadLoad, Setting
from supple.model.loads.build import applied
from supple.results.check.checks import joints as checked_joints
from supple.results.check.loads import forces_of
from supple.results.export.exporter import FORMATS, Format
from supple.results.readings.reading import READINGS, Reading
from supple.results.readings.sensor_readings import reading_of
from supple.results.view.from_recording import model_of_recording, render_frame_of
from supple.scene.joints.joint import Conditions, Function, Joint
from supple.scene.loads.load import OnBody
from supple.scene.registry import PARTS, register
from supple.scene.sensors import Sensor

# --- a shape: one function ----------------------------------------------------------------------------------------


def octahedron(radius: Annotated[float, POSITIVE] = 0.5, order: int = 1) -> sp.TetMesh:
    """A regular octahedron about the origin: eight tets that share their center.

    Parameters
    ----------
    radius : from the center to each corner [m]
    """
    ends = [(x, y, z) for x in (1, 2) for y in (3, 4) for z in (5, 6)]
    corners = np.concatenate([np.zeros((1, 3)), np.repeat(np.eye(3), 2, axis=0) * np.tile([[1.0], [-1.0]], (3, 1))])
    return sp.TetMesh(radius * corners, [(0, *end) for end in ends]).to_order(order)


# --- a material: its class, and its energy --------------------------------------------------------------------------


@dataclass(frozen=True, eq=False, kw_only=True)
class Logarithmic(ByLaw):
    """The Neo-Hookean energy mu/2 (tr C - 3 - 2 log J) + lam/2 (log J)^2.

    Parameters
    ----------
    shear : mu [Pa]
    """

    kind: ClassVar[str] = "logarithmic"
    shear_formula: ClassVar[str] = "shear"

    shear: Annotated[float, NumberPerTet(POSITIVE)]

    def rest_moduli(self):
        return np.asarray(self.shear), np.asarray(self.bulk)

    def law(self):
        return LOGARITHMIC

    def law_parameters(self):
        return ("shear", self.shear), ("bulk", self.bulk)


class LogarithmicLaw(Law):
    counts, name, infinite_when_flat = range(2, 3), "logarithmic", True

    def densities(self, F, p):
        J = np.linalg.det(F)
        with np.errstate(invalid="ignore", divide="ignore"):
            log = np.log(J)
            mu, lam = p[:, 0], p[:, 1] - 2.0 * p[:, 0] / 3.0
            psi = 0.5 * mu * ((F * F).sum(axis=(1, 2)) - 3.0 - 2.0 * log) + 0.5 * lam * log**2
        return np.where(J > 0.0, psi, np.inf)

    def models(self, F, p, second, project):
        mu, lam, G = p[:, 0], p[:, 1] - 2.0 * p[:, 0] / 3.0, np.linalg.inv(F).transpose(0, 2, 1)
        log = np.log(np.abs(np.linalg.det(F)))
        P = mu[:, None, None] * (F - G) + (lam * log)[:, None, None] * G
        H = np.zeros((len(F) if second else 0, 9, 9))
        if second:
            g = G.reshape(-1, 9)
            turned = np.einsum("kin,kmj->kijmn", G, G).reshape(-1, 9, 9)
            H += mu[:, None, None] * np.eye(9) + (mu - lam * log)[:, None, None] * turned
            H += lam[:, None, None] * g[:, :, None] * g[:, None, :]
            if project:
                values, vectors = np.linalg.eigh(H)
                H = np.einsum("kin,kn,kjn->kij", vectors, np.maximum(values, 0.0), vectors)
        return self.densities(F, p), P, H


LOGARITHMIC = LogarithmicLaw()


# --- a load: its class, its forces, and those that the verifier computes --------------------------------------------


@dataclass(frozen=True, eq=False)
class Thrust(OnBody):
    """A force on a whole body, in proportion to its mass: it accelerates without turning.

    Parameters
    ----------
    body : name of the body
    force : (3,) in total [N]
    name : appears in messages
    """

    kind: ClassVar[str] = "thrust"

    body: Annotated[str, BodyName()]
    force: Annotated[np.ndarray, Vector()]
    name: Annotated[str | None, Name()] = None


def thrust_on_vertices(load: Thrust, setting: Setting) -> list[AppliedLoad]:
    body = setting.body(load.body)
    vertices = (np.arange(len(body.mesh.vertices)) + setting.begins[load.body]).astype(np.int32)
    shares = setting.masses[vertices] / setting.masses[vertices].sum()
    return [DeadLoad.shared(vertices, shares, lambda time: np.asarray(load.force), "thrusts")]


def thrust_of_a_recording(load: Thrust, of):
    rows, shares = of.rows[load.body].vertices, np.zeros_like(of.masses)
    shares[rows] = of.masses[rows] / of.masses[rows].sum()
    return "thrusts", lambda time, x, v: shares[:, None] * load.force


# --- a joint: its class, its function, and what the verifier computes -----------------------------------------------


@dataclass(frozen=True, eq=False)
class Tether(Joint):
    """Two points that stay within a distance, as of a rope.

    Parameters
    ----------
    length : of the rope [m]
    """

    kind: ClassVar[str] = "tether"
    required: ClassVar[tuple[str, ...]] = ("length",)

    length: Annotated[float, POSITIVE] = 0.0

    def conditions(self):
        rope = Function("distance", ("apart",), (-np.inf, self.length))
        return Conditions(together=False, functions=(rope,))


def distance(vectors: np.ndarray) -> Values:
    """|a|, with the derivatives a / |a| and (1 - a a^T / |a|^2) / |a|."""
    a = vectors[:, 0]
    length = np.linalg.norm(a, axis=1)
    safe = np.where(length > 0.0, length, 1.0)
    n = a / safe[:, None]
    gradient, hessian = np.zeros((len(a), 4, 3)), np.zeros((len(a), 4, 3, 4, 3))
    gradient[:, 0] = n
    across = (np.eye(3) - n[:, :, None] * n[:, None, :]) / safe[:, None, None]
    hessian[:, 0, :, 0] = np.where(length[:, None, None] > 0.0, across, 0.0)
    return Values(length, gradient, hessian)


# --- a sensor: its class, and what it reads -------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Altimeter(Sensor):
    """The height of a body's center of mass.

    Parameters
    ----------
    name : under which frames have it
    body : name of the body
    above : height of the zero [m]
    """

    kind: ClassVar[str] = "altimeter"

    name: Annotated[str, Name()]
    body: Annotated[str, BodyName()]
    above: Annotated[float, ANY_NUMBER] = 0.0


@dataclass(frozen=True, eq=False)
class HeightReading(Reading):
    quantity: ClassVar[str] = "height [m]"
    shape: ClassVar[tuple[int, ...]] = (1,)

    height: float

    @property
    def value(self):
        return self.height

    def numbers(self):
        return np.array([self.height])

    @classmethod
    def of_numbers(cls, numbers):
        return cls(float(numbers[0]))

    @classmethod
    def columns(cls, numbers):
        return {"height": numbers[:, 0]}


def height(sensor: Altimeter, felt):
    rows = felt.part(sensor.body).vertices
    masses = felt.system.masses[rows]
    return HeightReading(float(masses @ felt.x[rows, 1] / masses.sum()) - sensor.above)


# --- an exporter and a command: one function each -------------------------------------------------------------------


def write_xyz(recording, path):
    """The points of the last frame, one on each line."""
    np.savetxt(path, np.concatenate(list(recording[-1].positions.values())))


def count(scene: str, /) -> None:
    """Print how many bodies a scene file has."""
    print(f"{len(sp.load_scene(scene).bodies)} bodies")


@pytest.fixture(autouse=True, scope="module")
def registered():
    lists = [MATERIALS, *(part.kinds for part in PARTS.values())]
    tables = [SHAPES, FORMS, checked_joints.FORMS, READINGS, FORMATS, COMMANDS]
    before = [one.copy() for one in (*lists, *tables)]
    shape(octahedron)
    MATERIALS.append(Logarithmic)
    for kind in (RoundedCube, Thrust, Tether, Altimeter):
        register(kind)
    applied.register(Thrust, thrust_on_vertices)
    forces_of.register(Thrust, thrust_of_a_recording)
    FORMS["distance"] = Form(1, of=distance)
    checked_joints.FORMS["distance"] = lambda vectors, R: float(np.linalg.norm(vectors[0]))
    reading_of.register(Altimeter, height)
    READINGS["altimeter"] = HeightReading
    FORMATS["xyz"] = Format(write_xyz, (".xyz",))
    register_command("count", f"{__name__}:count")
    yield
    for one, old in zip((*lists, *tables), before, strict=True):
        one.clear()
        one.extend(old) if isinstance(one, list) else one.update(old)
    del app["count"]


LOGARITHM = "{kind: logarithmic, shear: 2e4, bulk: 4e4, density: 1000, damping: 0.01}"
SCENE = f"""
bodies:
  - name: rocket
    shape: <kind: octahedron, radius: 0.1>
    material: {LOGARITHM}
    position: [0, 2, 0]
  - name: crate
    shape: <kind: octahedron, radius: 0.1>
    material: {LOGARITHM}
    position: [0, 0.605, 0]
  - name: bob
    shape: <kind: octahedron, radius: 0.1>
    rigid: <mass: 1>
    position: [2, 2, 0]
obstacles: [<kind: rounded_cube, name: block, half: 0.5, rounding: 0.1, friction: 0.5>]
loads: [<kind: thrust, body: rocket, force: [0, 20, 0]>]
joints: [<kind: tether, name: rope, first: bob, length: 0.1>]
sensors: [<kind: altimeter, name: altitude, body: rocket, above: 2>]
dt: 1/60
steps: 24
"""
SCENE = SCENE.replace("<", "{").replace(">", "}")
MASS = 1000.0 * 4.0 / 3.0 * 0.1**3  # of an octahedron [kg]
SOLVERS = {"xpbd": "{kind: xpbd, substeps: 20}", "implicit": "{kind: implicit}"}


@pytest.fixture(scope="module", params=SOLVERS)
def run(request, tmp_path_factory):
    """A scene file of new kinds, its frames with one of the solvers, and their recording."""
    folder = tmp_path_factory.mktemp(request.param)
    file = folder / "scene.yaml"
    scene = SCENE
    if request.param == "xpbd":  # it has constraints of its own for the materials that it simulates
        scene = SCENE.replace(LOGARITHM, "{kind: stable_neo_hookean, youngs: 4e4, poisson: 0.3, damping: 0.01}")
    file.write_text(scene + f"solver: {SOLVERS[request.param]}\n")
    loaded = load_run(file)
    recording = folder / "recording.vtkhdf"
    sinks = [sp.Recorder(recording)]
    return file, list(sp.simulate(loaded.scene, loaded.solver, loaded.dt, loaded.steps, sinks=sinks)), recording


def test_the_schema_has_them_with_their_descriptions(run):
    file, *_ = run
    schema = json_schema()
    assert not list(Draft202012Validator(schema).iter_errors(read_yaml(file).data))
    definitions = schema["$defs"]
    assert definitions["TetherModel"]["properties"]["length"]["description"] == "of the rope [m]"
    assert definitions["OctahedronShapeModel"]["properties"]["radius"]["exclusiveMinimum"] == 0.0
    data = read_yaml(file).data
    del data["joints"][0]["length"]
    assert [list(error.path) for error in Draft202012Validator(schema).iter_errors(data)] == [["joints", 0]]


def test_errors_of_a_scene_file_have_line_and_key(tmp_path):
    file = tmp_path / "scene.yaml"
    file.write_text(SCENE.replace("length: 0.1", "length: -1"))
    with pytest.raises(sp.SceneError, match=r"scene.yaml:17: joints\[0\].length: is -1; it must be above 0"):
        load_run(file)
    file.write_text(SCENE.replace("force: [0, 20, 0]", "forse: [0, 20, 0]"))
    with pytest.raises(sp.SceneError, match=r"loads\[0\].forse: unknown key; did you mean 'force'\?"):
        load_run(file)


def test_a_thrust_accelerates(run):
    _, frames, _ = run
    t = frames[-1].time
    risen = frames[-1].sensors["altitude"].height
    assert risen == pytest.approx(0.5 * (20.0 / MASS - 9.81) * t**2, rel=0.06)
    assert sum(frame.report.work["thrusts"] for frame in frames) == pytest.approx(20.0 * risen, rel=0.06)


def test_the_new_material_carries_the_crate_on_the_new_obstacle(run):
    _, frames, _ = run
    lowest = [frame.positions["crate"][:, 1].min() for frame in frames]
    assert min(lowest) > 0.5 - 1e-4
    assert lowest[-1] == pytest.approx(0.5, abs=5e-3)


def test_a_solver_without_the_new_material_says_so(tmp_path):
    file = tmp_path / "scene.yaml"
    file.write_text(SCENE + "solver: {kind: xpbd}\n")
    loaded = load_run(file)
    with pytest.raises(sp.SolverError, match="the material Logarithmic, which XPBD cannot simulate"):
        next(iter(sp.simulate(loaded.scene, loaded.solver, loaded.dt, 1)))


def test_what_refers_to_a_body_is_known_by_its_fields(run):
    file, *_ = run
    scene = load_run(file).scene
    found = {key: [item.label for item in items] for key, items in scene.referring("rocket").items() if items}
    assert found == {"loads": ["thrust on body 'rocket'"], "sensors": ["altimeter 'altitude'"]}
    assert [joint.label for joint in scene.referring("bob")["joints"]] == ["joint 'rope'"]


def test_a_tether_holds(run):
    _, frames, _ = run
    fallen = [2.0 - frame.positions["bob"][:, 1].mean() for frame in frames]
    assert max(fallen) == pytest.approx(0.1, abs=2e-3)
    assert frames[5].report.joints["rope"].coordinate == pytest.approx(fallen[5], abs=1e-9)
    pull = frames[-1].report.joints["rope"].force
    assert pull[1] == pytest.approx(9.81, rel=0.05)


def test_a_recording_keeps_them(run):
    _, frames, path = run
    with sp.read_recording(path) as recording:
        assert recording[-1].sensors["altitude"].height == frames[-1].sensors["altitude"].height
        (block,) = recording.obstacles
        assert (block.half, block.rounding, block.friction) == (0.5, 0.1, 0.5)
        rocket, _, bob = recording.scene.bodies
        assert isinstance(rocket.material, Logarithmic if "implicit" in str(path) else sp.StableNeoHookean)
        assert bob.mass == 1.0
        (rope,), (thrust,) = recording.scene.joints, recording.scene.loads
        assert isinstance(rope, Tether)
        assert rope.length == 0.1
        assert isinstance(thrust, Thrust)
        np.testing.assert_array_equal(thrust.force, [0, 20, 0])


def test_checks_accept_it_and_find_what_is_wrong(run, tmp_path):
    _, frames, path = run
    report = sp.check_recording(path)
    passed = {result.name for result in report.results if result.verdict == "pass"}
    assert passed >= {"joints", "obstacles", "containment", "intersection", "balance", "works", "energy", "records"}
    assert [result.name for result in report.failures if result.name != "status"] == []
    copy = tmp_path / "copy.vtkhdf"
    copy.write_bytes(path.read_bytes())
    with h5py.File(copy, "r+") as file:
        n = len(file["VTKHDF/Points"]) // (len(frames) + 1)
        points = file["VTKHDF/Points"]
        points[10 * n + 14 : 10 * n + 18] -= [0.0, 0.3, 0.0]  # bob hangs lower than the rope is long
        points[20 * n : 20 * n + 7] += [0.0, 0.1, 0.0]  # the rocket is higher than its thrust lifts it
    report = sp.check_recording(copy, only=["joints", "works"])
    assert report["joints"].first_failure == 10
    assert str(report["joints"].where).startswith("rope")
    assert report["works"].verdict == "fail"


def test_a_page_draws_them(run, tmp_path):
    _, _, path = run
    with sp.read_recording(path) as recording:
        drawn = render_frame_of(model_of_recording(recording), recording[-1])
        assert len(drawn.model.bodies) == 3
        recording.export("html", tmp_path / "page.html")
    assert (tmp_path / "page.html").stat().st_size > 100_000


def test_info_lists_them(run, capsys):
    file, *_ = run
    assert main(["info", str(file)]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "block (RoundedCube)" in text
    assert "thrust on body 'rocket' force (0, 20, 0)" in text
    assert "Tether of bob and the world" in text
    assert "length 0.1" in text
    assert "altimeter 'altitude' above 2" in text
    assert "Logarithmic (small strains: E = " in text or "xpbd" in str(file)


def test_the_exporter_and_the_command(run, tmp_path, capsys):
    file, frames, path = run
    output = tmp_path / "points.xyz"
    assert main(["export", str(path), "--to", "xyz", "-o", str(output)]) == 0
    np.testing.assert_allclose(np.loadtxt(output)[:7], frames[-1].positions["rocket"], atol=1e-6)
    capsys.readouterr()
    assert main(["count", str(file)]) == 0
    assert capsys.readouterr().out == "3 bodies\n"
