"""Bodies and scenes that tests of both solvers build, and what all their frames must be."""

import numpy as np

import supple as sp
from supple.model.system import initial_state
from supple.simulate import first_frame

G = 9.81
FLOOR = sp.HalfSpace(point=(0, 0, 0), normal=(0, 1, 0), friction=0.5, name="floor")
CUBE = sp.shapes.box_surface((0.1, 0.1, 0.1), (1, 1, 1))
BOX = sp.shapes.box_surface((0.1, 0.2, 0.3), (1, 1, 1))
BAR = sp.shapes.box_surface((1.0, 0.05, 0.05), (1, 1, 1))  # of 2.5 kg


def converged(frames):
    """All frames of a simulation, of which each converged."""
    frames = list(frames)
    assert {frame.report.status for frame in frames} == {"converged"}, [
        frame.report.message for frame in frames if frame.report.message
    ]
    return frames


def at_start(scene, **given):
    """The report of a scene before its first step, with initial positions and velocities if given."""
    return first_frame(scene, initial_state(scene, **given)).report


def rigid(name="rigid", shape=CUBE, **values):
    return sp.RigidBody(name, shape, **({"density": 1000.0} | values))


def soft(name="soft", youngs=1e5, density=1000.0, **values):
    material = sp.StableNeoHookean(youngs=youngs, poisson=0.3, density=density)
    return sp.Body(name, sp.shapes.box((0.1, 0.1, 0.1), (2, 2, 2)), material, **values)


def bar(name="bar", **values):
    return rigid(name, BAR, **({"position": (0.5, 0, 0)} | values))


def hinge(first="bar", second=None, **values):
    return sp.HingeJoint(first, second, **({"point": (0, 0, 0), "name": "hinge"} | values))


def momenta(frames):
    """Linear and angular momenta of frames, (n, 3) each."""
    return (np.array([getattr(f.report, key) for f in frames]) for key in ("linear_momentum", "angular_momentum"))


def gyroscope():
    """A disk that spins about a horizontal axis on a ball joint, and the rate of its steady precession [rad/s].

    The rate is m g l / (I w), exactly.
    """
    length, spin = 0.1, 50.0
    disk = sp.shapes.box_surface((0.2, 0.02, 0.2), (1, 1, 1))
    properties = rigid(shape=disk, density=2700.0).properties
    rate = properties.mass * G * length / (properties.inertia[1, 1] * spin)
    place = {"position": (length, 0, 0), "rotation": (0, 0, -np.pi / 2), "velocity": (0, 0, -rate * length)}
    body = rigid("disk", disk, density=2700.0, angular_velocity=(spin, rate, 0), **place)
    return sp.Scene([body], joints=[sp.BallJoint("disk", point=(0, 0, 0))]), rate


def rate_of_precession(frames, dt, off):
    """Of the disk of `gyroscope`, whose center stays at the height of the joint within `off` [rad/s]."""
    centers = np.array([frame.poses["disk"].translation for frame in frames])
    assert np.abs(centers[:, 1]).max() < off
    angles = np.unwrap(np.arctan2(-centers[:, 2], centers[:, 0]))
    return (angles[-1] - angles[0]) / (dt * (len(frames) - 1))


SPIN = np.array([0.5, 10.0, 0.5])


def changes_of_sign(times, values):
    k = np.flatnonzero(values[1:] * values[:-1] < 0.0)
    return times[k] + (times[k + 1] - times[k]) * values[k] / (values[k] - values[k + 1])


def flips_of_eulers_equations(inertia, end, dt=1e-3):
    """When a body that begins with `SPIN` turns over [s]: Runge-Kutta's method of fourth order."""
    a, b, c = inertia

    def rate(w):
        return np.array([(b - c) * w[1] * w[2] / a, (c - a) * w[2] * w[0] / b, (a - b) * w[0] * w[1] / c])

    path = [SPIN]
    for _ in range(round(end / dt)):
        w = path[-1]
        k1 = rate(w)
        k2 = rate(w + 0.5 * dt * k1)
        k3 = rate(w + 0.5 * dt * k2)
        path.append(w + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + rate(w + dt * k3)))
    return changes_of_sign(dt * np.arange(len(path)), np.array(path)[:, 1])


def flips_of(frames, dt):
    """When the body "rigid" of frames turns over [s]."""
    poses = [frame.poses["rigid"] for frame in frames]
    along = np.array([SPIN[1], *((pose.rotation.T @ pose.angular_velocity)[1] for pose in poses)])
    return changes_of_sign(dt * np.arange(len(along)), along)


def contact_gap(body: sp.Body | sp.RigidBody) -> float:
    """The distance [m] that a compact body keeps in XPBD by default: 0.003 of its diagonal at rest."""
    return 3e-3 * float(np.linalg.norm(np.ptp(body.mesh.vertices, axis=0)))
