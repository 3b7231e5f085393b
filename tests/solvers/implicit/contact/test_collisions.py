"""Bodies that collide: momenta, energies, order of convergence; nothing crosses."""

from functools import cache

import ipctk
import numpy as np
import pytest
from tests.scenes import converged

import supple as sp
from supple.model.system import initial_state
from supple.simulate import first_frame


def cube(name, **body):
    material = sp.StableNeoHookean(youngs=2e4, poisson=0.3, density=1000.0)
    return sp.Body(name, sp.shapes.box((0.2, 0.2, 0.2), (1, 1, 1)), material, **body)


def oblique():
    """Two cubes that meet off center, one spinning."""
    one = cube("one", position=(-0.15, 0, 0), velocity=(1, 0, 0), angular_velocity=(0, 1, 2))
    two = cube("two", position=(0.1, 0.05, 0.03), velocity=(-1, 0, 0))
    return sp.Scene([one, two], gravity=(0, 0, 0))


@cache
def collide(dt, steps, **solver):
    scene = oblique()
    frames = converged(sp.simulate(scene, sp.Implicit(**solver), dt, steps))
    assert any(frame.report.details.contacts for frame in frames)
    assert frames[-1].report.details.contacts == 0  # they have separated again
    return [first_frame(scene, initial_state(scene)), *frames]


def library_mesh(system):
    """All surfaces of a system as one mesh of the contact library."""
    faces = np.asfortranarray(system.triangles, dtype=np.int32)
    return ipctk.CollisionMesh(np.asfortranarray(system.rest_positions), ipctk.edges(faces), faces)


def energy(frame):
    return frame.report.kinetic_energy + frame.report.elastic_energy


@pytest.mark.parametrize("integrator", ["backward_euler", "bdf2", "newmark"])
def test_a_collision_keeps_linear_momentum(integrator):
    frames = collide(0.005, 50, integrator=integrator)
    momenta = np.array([frame.report.linear_momentum for frame in frames])
    # The bodies' momenta cancel: what counts is what went from one to the other.
    part = frames[0].system.masses[:8] @ frames[0].velocities["one"]
    assert np.abs(momenta - momenta[0]).max() < 1e-9 * np.linalg.norm(part)
    separated = frames[-1].velocities["two"].mean(axis=0)[0] - frames[-1].velocities["one"].mean(axis=0)[0]
    assert separated > 0.5


@pytest.mark.parametrize("integrator", ["backward_euler", "bdf2", "newmark"])
def test_contact_forces_have_no_total_moment(integrator):
    """Contact adds no angular momentum; the time integrator may."""
    for frame in collide(0.005, 50, integrator=integrator)[1:]:
        forces = frame.report.details.contact_forces
        total = np.linalg.norm(forces["one"])
        assert np.linalg.norm(forces["one"] + forces["two"]) <= 1e-9 * total
        found = frame.contacts
        moment = np.cross(found.points, found.forces)
        # Both sides of a contact lie on the line of its force.
        lever = np.cross(found.normals, found.forces)
        assert np.abs(lever).max(initial=0.0) <= 1e-6 * total
        assert np.isfinite(moment).all()


def test_the_error_of_angular_momentum_falls_with_the_step():
    drift = []
    for steps in (40, 160):
        frames = collide(0.2 / steps, steps, tolerance=1e-6)
        momenta = np.array([frame.report.angular_momentum for frame in frames])
        drift.append(np.abs(momenta[-1] - momenta[0]).max() / np.linalg.norm(momenta[0]))
    assert drift[0] < 0.05
    assert drift[1] < 0.5 * drift[0]


def test_backward_euler_never_gains_energy():
    energies = np.array([energy(frame) for frame in collide(0.005, 50, integrator="backward_euler")])
    # The barrier holds some of it while they touch, and gives it back.
    assert energies.max() <= energies[0] * (1 + 1e-9)
    assert energies[-1] < energies[0]


@pytest.mark.parametrize("integrator", ["bdf2", "newmark"])
def test_second_order_collisions_keep_the_energy_that_they_should(integrator):
    energies = np.array([energy(frame) for frame in collide(0.0025, 80, integrator=integrator)])
    # With steps of a quarter of this: newmark 0.55, bdf2 0.52, backward Euler 0.46. The rest vibrates, or was lost.
    assert energies.max() <= energies[0] * (1 + 1e-5)
    assert 0.45 * energies[0] < energies[-1] < 0.66 * energies[0]


@pytest.mark.parametrize("dt", [0.001, 0.05, 0.2])
def test_fast_bodies_do_not_pass_through_each_other(dt):
    """From a thousandth to several lengths of the cube in one step."""
    one = cube("one", position=(0, 0.2, 0), velocity=(0, 0, 0))
    two = cube("two", position=(0.03, 0.6, 0.02), velocity=(0, -20, 0))
    scene = sp.Scene([one, two], obstacles=[sp.HalfSpace()], gravity=(0, -9.81, 0))
    frames = list(sp.simulate(scene, sp.Implicit(), dt, 4 if dt > 0.001 else 25))
    check = library_mesh(frames[0].system)
    for frame in frames:
        # Such a blow crushes a tet, which has a status of its own.
        assert frame.report.status == ("converged" if frame.report.min_det_F >= 0.05 else "crushed")
        assert frame.report.min_det_F > 0.0
        assert frame.positions["one"][:, 1].min() > 0.0
        assert frame.positions["two"][:, 1].min() > 0.0
        assert not ipctk.has_intersections(check, np.asfortranarray(frame.state.positions))


def test_a_folded_strip_does_not_cross_itself():
    """A thin strip, clamped at one end, whose other end is pressed onto it."""
    mesh = sp.shapes.box((1.0, 0.05, 0.1), (20, 1, 2))
    material = sp.StableNeoHookean(youngs=1e4, poisson=0.3, density=1000.0)
    left = np.flatnonzero(mesh.vertices[:, 0] < -0.49)
    right = np.flatnonzero(mesh.vertices[:, 0] > 0.49)
    over = sp.Keyframes(times=[0, 0.5], angles=[0, 3.1], axis=(0, 0, 1), pivot=(0, 0.08, 0))
    pins = [sp.Pin("strip", left), sp.Pin("strip", right, motion=over)]
    scene = sp.Scene([sp.Body("strip", mesh, material)], pins=pins, gravity=(0, 0, 0))
    frames = list(sp.simulate(scene, sp.Implicit(), 0.05, 14))
    check = library_mesh(frames[0].system)
    for frame in frames:
        assert frame.report.status == "converged"
        assert not ipctk.has_intersections(check, np.asfortranarray(frame.positions["strip"]))
