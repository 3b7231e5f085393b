"""Welds: elimination of vertices, motions and forces, contact near them, and what is refused."""

import numpy as np
import pytest

import supple as sp
from supple.implicit.energies.potential import HessianBlocks
from supple.implicit.newton.reduction import Reduction
from supple.numerics.sparse.couplings import Couplings
from supple.system import build_system

G = 9.81
BEAM = sp.shapes.box((0.4, 0.1, 0.1), (4, 1, 1))
LEFT = np.flatnonzero(BEAM.vertices[:, 0] < -0.199)
CUBE = sp.shapes.box_surface((0.1, 0.1, 0.1), (1, 1, 1))
SOFT = sp.StableNeoHookean(youngs=2e5, poisson=0.3, density=1000)


def beam(**values):
    return sp.Body("beam", BEAM, SOFT, **values)


def cube(**values):
    return sp.RigidBody("cube", CUBE, density=1000, **({"position": (-0.25, 0, 0)} | values))


def run(scene, dt=0.01, steps=5, integrator="backward_euler", contact=None, **more):
    frames = list(sp.simulate(scene, sp.Implicit(integrator=integrator, contact=contact), dt, steps, **more))
    assert {frame.report.status for frame in frames} == {"converged"}
    return frames


def test_the_reduced_hessian_is_that_of_the_free_vertices():
    """Elements, vertices and couplings, against T^T H T with dense matrices."""
    scene = sp.Scene([beam(), cube()], welds=[sp.Weld("beam", "cube", LEFT)])
    system = build_system(scene)
    reduction, n = Reduction.of(system), len(system.masses)
    rng = np.random.default_rng(0)
    blocks = HessianBlocks.zeros(len(system.tets), n)
    elements = rng.normal(size=blocks.elements.shape)
    blocks.elements[:] = elements + elements.transpose(0, 2, 1)
    at_vertices = rng.normal(size=(n, 3, 3))
    blocks.vertices[:] = at_vertices + at_vertices.transpose(0, 2, 1)
    rows, columns = rng.integers(0, n, (2, 40)).astype(np.int32)
    given = rng.normal(size=(40, 3, 3))
    given[rows == columns] += given[rows == columns].transpose(0, 2, 1)
    # Both ends welded, and a welded vertex with a control point of its own.
    rows[:3], columns[:3] = [LEFT[0], LEFT[1], LEFT[2]], [LEFT[1], n - 1, LEFT[2]]
    given[2] += given[2].T
    blocks.couplings.append(Couplings(rows, columns, given))

    def dense(couplings, with_elements):
        H = np.zeros((3 * n, 3 * n))
        for p in range(n):
            if with_elements or not reduction.welded[p]:
                H[3 * p : 3 * p + 3, 3 * p : 3 * p + 3] += blocks.vertices[p]
        for nodes, element in zip(system.tets, blocks.elements, strict=True):
            kept = np.ones(4, bool) if with_elements else ~reduction.welded[nodes]
            where = (3 * nodes[:, None] + np.arange(3)).ravel()
            mask = np.repeat(kept, 3)
            H[np.ix_(where[mask], where[mask])] += element[np.ix_(mask, mask)]
        for one in couplings:
            unit = np.eye(3 * n).reshape(-1, n, 3)
            H += np.array([_product(one, column) for column in unit])
        return H

    def _product(one, x):
        out = np.zeros((n, 3))
        one.add_product(x, out)
        return out.ravel()

    T = np.eye(3 * n)
    for vertex, control, weights in zip(
        system.welding.vertices, system.welding.control, system.welding.weights, strict=True
    ):
        T[3 * vertex : 3 * vertex + 3] = 0.0
        for k, w in zip(control, weights, strict=True):
            T[3 * vertex : 3 * vertex + 3, 3 * k : 3 * k + 3] = w * np.eye(3)
    free = np.repeat(~reduction.welded, 3)
    expected = (T.T @ dense(blocks.couplings, True) @ T)[np.ix_(free, free)]
    found = dense(reduction.couplings(blocks), False)[np.ix_(free, free)]
    np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(expected).max())
    gradient = rng.normal(size=(n, 3))
    reduced = gradient.copy()
    reduction.reduce(reduced)
    np.testing.assert_allclose(reduced.ravel()[free], (T.T @ gradient.ravel())[free], atol=1e-13)


def test_a_beam_welded_to_a_held_body_is_a_beam_that_is_held():
    """Alike to round-off, also where both are moved; the reactions of both pins are the same."""
    held = sp.Scene([beam()], pins=[sp.Pin("beam", LEFT, name="pin")])
    welded = sp.Scene([beam(), cube()], pins=[sp.Pin("cube", name="pin")], welds=[sp.Weld("beam", "cube", LEFT)])
    (one,), (other,) = (run(scene, 1.0, 1, "static") for scene in (held, welded))
    np.testing.assert_allclose(other.positions["beam"], one.positions["beam"], atol=1e-12)
    weight = 4.0 * G
    np.testing.assert_allclose(other.report.details.weld_forces["Weld 1"], [0, weight, 0], atol=1e-8)
    np.testing.assert_allclose(
        other.report.details.reaction_forces["pin 'pin' of body 'cube'"], [0, weight + G, 0], atol=1e-8
    )
    turned = sp.Keyframes([0, 1], angles=[0, 2])
    held = sp.Scene([beam()], pins=[sp.Pin("beam", LEFT, motion=turned)])
    welded = sp.Scene([beam(), cube()], pins=[sp.Pin("cube", motion=turned)], welds=[sp.Weld("beam", "cube", LEFT)])
    one, other = (run(scene)[-1].positions["beam"] for scene in (held, welded))
    np.testing.assert_allclose(other, one, atol=1e-6)


def test_what_is_welded_flies_as_one_body():
    spin = np.array([0.0, 0.0, 3.0])
    rigid = cube(velocity=np.cross(spin, (-0.25, 0, 0)), angular_velocity=spin)
    scene = sp.Scene([beam(angular_velocity=spin), rigid], welds=[sp.Weld("beam", "cube", LEFT)], gravity=(0, 0, 0))
    frames = run(scene, 0.005, 20, "bdf2")
    P, L = (np.array([getattr(f.report, key) for f in frames]) for key in ("linear_momentum", "angular_momentum"))
    np.testing.assert_allclose(P, np.broadcast_to(P[0], P.shape), atol=1e-12)
    assert np.abs(L - L[0]).max() < 1e-3 * np.linalg.norm(L[0])
    pose = frames[-1].poses["cube"]
    on_cube = BEAM.vertices[LEFT] + [0.25, 0, 0]
    np.testing.assert_allclose(
        frames[-1].positions["beam"][LEFT], on_cube @ pose.rotation.T + pose.translation, atol=1e-6
    )


def test_contact_is_masked_near_the_weld_only(tmp_path):
    """Faces that are welded touch from the start; a plate that the beam leans on is felt."""
    table = sp.RigidBody(
        "table", sp.shapes.box_surface((0.2, 0.1, 0.3), (1, 1, 1)), density=1000, position=(0.15, -0.105, 0)
    )
    scene = sp.Scene(
        [beam(friction=0.3), cube(), table],
        pins=[sp.Pin("cube"), sp.Pin("table")],
        welds=[sp.Weld("beam", "cube", max_distance=1e-6)],
    )
    recorder = sp.Recorder(tmp_path / "weld.vtkhdf")
    frames = run(scene, 0.02, 15, contact=sp.IPCContact(), sinks=[recorder])
    assert frames[-1].report.details.contact_forces["table"][1] < -0.1 * 4.0 * G
    assert frames[-1].contacts.force_between("beam", "cube").tolist() == [0, 0, 0]
    report = sp.check_recording(tmp_path / "weld.vtkhdf")
    assert report.ok, str(report)
    assert report["welds"].worst < 1e-13


SCENE = """\
bodies:
  - name: finger
    shape: {kind: box, size: [0.4, 0.1, 0.1], divisions: [2, 1, 1]}
    material: {kind: stable_neo_hookean, youngs: 1e5, poisson: 0.3}
  - name: palm
    shape: {kind: box, size: [0.1, 0.1, 0.1], divisions: [1, 1, 1]}
    rigid: {mass: 1}
    position: [-0.25, 0, 0]
welds:
  - {body: finger, rigid: palm, max_distance: 1e-4}
"""


def test_welds_of_scene_files(tmp_path):
    path = tmp_path / "scene.yaml"
    for chosen in ("max_distance: 1e-4", "box: {low: [-1, -1, -1], high: [-0.19, 1, 1]}", "vertices: [0, 3, 6, 9]"):
        path.write_text(SCENE.replace("max_distance: 1e-4", chosen))
        scene = sp.load_scene(path)
        assert len(scene.welding) == 4
        assert scene.welds[0].name == "Weld 1"
    path.write_text(SCENE.replace("1e-4}", "1e-4, box: {low: [0, 0, 0], high: [1, 1, 1]}}"))
    with pytest.raises(sp.SceneError, match=r"scene.yaml:10: welds\[0\]: give the vertices by one of"):
        sp.load_scene(path)


@pytest.mark.parametrize(
    ("make", "problem"),
    [
        (lambda: sp.Weld("beam", "cube"), "give its vertices by either `vertices` or `max_distance`"),
        (lambda: sp.Weld("beam", "cube", [0], 0.1), "give its vertices by either `vertices` or `max_distance`"),
        (lambda: sp.Weld("beam", "cube", max_distance=-1), "max_distance is -1; it must be above zero"),
        (lambda: scene_of(sp.Weld("bean", "cube", [0])), "there is no body 'bean'; did you mean 'beam'?"),
        (lambda: scene_of(sp.Weld("cube", "beam", [0])), "body 'cube' is rigid; a weld is of a soft body to a rigid"),
        (lambda: scene_of(sp.Weld("beam", "cube", [99])), "vertex 99 does not exist"),
        (lambda: scene_of(sp.Weld("beam", "cube", LEFT), sp.Weld("beam", "cube", LEFT[:1])), "is already welded"),
        (
            lambda: sp.Scene([beam(), cube(position=(-1, 0, 0))], welds=[sp.Weld("beam", "cube", max_distance=0.1)]),
            "no vertex is within 0.1 m of body 'cube'; the nearest is 0.75 m away",
        ),
        (
            lambda: sp.Scene([beam(), cube()], pins=[sp.Pin("beam", LEFT)], welds=[sp.Weld("beam", "cube", LEFT)]),
            "is also held by a pin; pin the rigid body instead",
        ),
    ],
)
def test_bad_welds_are_refused_in_one_line(make, problem):
    with pytest.raises(sp.SceneError) as error:
        make()
    assert problem in str(error.value)
    assert "\n" not in str(error.value)


def scene_of(*welds):
    return sp.Scene([beam(), cube()], welds=welds)


def test_a_start_at_which_welded_vertices_are_elsewhere_is_refused():
    with pytest.raises(sp.SceneError, match=r"weld 'Weld 1' of body 'beam': at the start vertex [0-3] is 0.1 m off"):
        sp.simulate(
            scene_of(sp.Weld("beam", "cube", LEFT)),
            sp.Implicit(contact=None),
            0.01,
            1,
            initial_positions={"beam": BEAM.vertices + np.array([0.1, 0.0, 0.0])},
        )
