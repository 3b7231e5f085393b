"""Scenes of a few tets as functions of parameters near 1, whose gradients are compared with differences of runs."""

from dataclasses import replace

import numpy as np

import supple as sp


def implicit(integrator="bdf2", friction_iterations=1):
    """A solver whose steps are minima up to round-off."""
    return sp.Implicit(
        integrator=integrator,
        tolerance=1e-13 if integrator == "static" else 1e-10,
        force_tolerance=1e-9,
        contact=sp.IPCContact(friction_iterations=friction_iterations),
    )


def bar(youngs=1.0, density=1.0, poisson=0.35, damping=0.0, size=(0.4, 0.1, 0.1), cells=(4, 1, 1), **placed):
    rubber = sp.StableNeoHookean(youngs=1e5 * youngs, poisson=poisson, density=1000 * density, damping=damping)
    return sp.Body("bar", sp.shapes.box(size, cells), rubber, **placed)


def end(body, side):
    """The vertices of the left end, side -1, or the right one."""
    x = side * body.mesh.vertices[:, 0]
    return np.flatnonzero(x > x.max() - 1e-9)


def ramp(t):
    return min(t / 0.05, 1.0)


def cantilever(p):
    body = bar(p[0], p[1], 0.35 * p[2])
    force = sp.Force("bar", end(body, 1), (0, -0.5 * p[3], 0))
    return sp.Scene([body], pins=[sp.Pin("bar", end(body, -1))], forces=[force], gravity=(0, -9.81, 0))


def rest_shape(p):
    body = bar(size=(0.4 * p[0], 0.1 * p[1], 0.1))
    return sp.Scene([body], pins=[sp.Pin("bar", end(body, -1))])


def damped(p):
    body = bar(p[0], p[1], damping=0.05 * p[2])
    return sp.Scene([body], pins=[sp.Pin("bar", end(body, -1))])


def pulled(p):
    body = bar(p[0], p[1])
    way = np.array([0.05, 0.1, 0.0]) * p[2]
    pins = [sp.Pin("bar", end(body, -1)), sp.Pin("bar", end(body, 1), motion=lambda t: way * ramp(t), name="grip")]
    return sp.Scene([body], pins=pins)


def flight(p):
    body = bar(p[0], velocity=(p[1], p[2], 0), angular_velocity=(0, 0, 3 * p[3]))
    return sp.Scene([body])


def on_floor(p, friction):
    body = bar(p[0], p[1], damping=0.01, position=(0, 0.0502, 0), velocity=(0.5 * p[2], -0.3, 0))
    return sp.Scene([body], obstacles=[sp.HalfSpace(name="floor", friction=friction * p[3])])


def frictionless(p):
    return on_floor(p, 0.0)


def sliding(p):
    return on_floor(p, 0.4)


def sticking(p):
    return on_floor([p[0], p[1], 0.05 * p[2], p[3]], 0.9)


def on_ball(p):
    body = bar(p[0], p[1], position=(0.03, 0.0505, 0), velocity=(0.2 * p[2], -0.3, 0))
    return sp.Scene([body], obstacles=[sp.obstacles.Sphere((0, -0.1 * p[3], 0), 0.1 * p[3], name="ball")])


def landing(p, friction=0.0):
    low = bar(p[0], p[2], size=(0.2, 0.1, 0.1), cells=(2, 1, 1), friction=friction)
    rubber = sp.StableNeoHookean(youngs=5e4 * p[1], density=800, poisson=0.3)
    mesh = sp.shapes.box((0.1, 0.08, 0.08), (1, 1, 1))
    velocity = (0.1, -0.2 * p[3], 0)
    top = sp.Body("top", mesh, rubber, position=(0.013, 0.0905, 0.004), velocity=velocity, friction=friction)
    return sp.Scene([low, top], pins=[sp.Pin("bar", np.flatnonzero(low.mesh.vertices[:, 1] < -0.049))])


def landing_roughly(p):
    return landing(p, 0.5 * p[3])


def tilted(p):
    """A corner, then edges, of a rough block on another."""
    low = bar(p[0], size=(0.2, 0.1, 0.1), cells=(3, 2, 2), friction=0.3 * p[2])
    mesh = sp.shapes.box((0.1, 0.08, 0.08), (2, 2, 2))
    placed = {"position": (0.013, 0.125, 0.004), "rotation": (20, 10, 13), "velocity": (0.1, -0.4 * p[3], 0)}
    rubber = sp.StableNeoHookean(youngs=5e4 * p[1], density=800, poisson=0.3)
    top = sp.Body("top", mesh, rubber, friction=0.3 * p[2], **placed)
    return sp.Scene([low, top], pins=[sp.Pin("bar", np.flatnonzero(low.mesh.vertices[:, 1] < -0.049))])


def fork(p):
    """Two prongs of one body that are pressed together."""
    whole = sp.shapes.box((0.4, 0.15, 0.1), (4, 3, 1))
    x, y, _ = whole.vertices[whole.tets].mean(axis=1).T
    used, tets = np.unique(whole.tets[(x < -0.1) | (np.abs(y) > 0.025)], return_inverse=True)
    mesh = sp.TetMesh(whole.vertices[used], tets.reshape(-1, 4))
    rubber = sp.StableNeoHookean(youngs=1e5 * p[0], poisson=0.35, density=1000 * p[1], damping=0.02)
    body = sp.Body("bar", mesh, rubber, friction=0.3 * p[2])
    x, y, _ = mesh.vertices.T
    squeeze = [
        sp.Force("bar", np.flatnonzero((x > 0.19) & (side * y > 0.05)), (0, -side * 6 * p[3], side), name=name)
        for side, name in ((1, "upper"), (-1, "lower"))
    ]
    return sp.Scene([body], pins=[sp.Pin("bar", np.flatnonzero(x < -0.19))], forces=squeeze, gravity=(0, 0, 0))


def quadratic(p):
    mesh = sp.shapes.box((0.4, 0.1, 0.1), (2, 1, 1), order=2)
    rubber = sp.StableNeoHookean(youngs=1e5 * p[0], density=1000 * p[1], poisson=0.48, damping=0.02 * p[2])
    body = sp.Body("bar", mesh, rubber)
    return sp.Scene([body], pins=[sp.Pin("bar", end(body, -1))])


def pressed(p):
    """By a pressure on an open surface, and by springs that move."""
    body = bar(p[0], p[1])
    top = [k for k, corners in enumerate(body.mesh.vertices[body.triangles]) if (corners[:, 1] > 0.049).all()]
    grip = sp.SoftTarget("bar", end(body, -1), stiffness=50 * p[2], motion=lambda t: (0, 0.1 * p[2] * ramp(t), 0))
    return sp.Scene([body], soft_targets=[grip], loads=[sp.Pressure("bar", lambda t: 800 * p[3] * ramp(t), region=top)])


def in_field(p):
    """Of forces that depend on the place; a spring, and growth."""
    body = bar(p[0], p[1])
    field = sp.BodyForce(lambda x, t: -200 * p[2] * x + np.sin(5 * x))
    spring = sp.Spring(("bar", 19), ("bar", 0), stiffness=100 * p[3])
    growth = sp.Growth("bar", lambda t: 1 + 0.2 * p[2] * ramp(t))
    return sp.Scene([body], loads=[field, spring, growth], gravity=(0, 0, 0))


def twisted(p):
    """By a script that turns, whose steps are divided."""
    body = bar(p[0], p[1], damping=0.01)
    turn = sp.Keyframes([0, 0.05], angles=[0, 2.5 * p[2]], axis=(1, 0, 0))
    return sp.Scene([body], pins=[sp.Pin("bar", end(body, -1)), sp.Pin("bar", end(body, 1), motion=turn)])


def on_moving_floor(p):
    body = bar(p[0], p[1], position=(0, 0.0502, 0))
    floor = sp.HalfSpace(name="floor", friction=0.5 * p[3], motion=lambda t: (0.5 * p[2] * t, 0.2 * t, 0))
    return sp.Scene([body], obstacles=[floor])


def chain(p):
    """A ball joint, and a hinge at its limit."""
    shape = sp.shapes.box((0.2, 0.06, 0.06), (2, 1, 1))
    base = sp.RigidBody("base", sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1)), density=1000.0, position=(-0.3, 0, 0))
    one = sp.RigidBody("bar", shape, density=500 * p[0], angular_velocity=(0, p[1], 0))
    other = sp.RigidBody("other", shape, density=500.0, position=(0.25, 0, 0))
    joints = [
        sp.BallJoint("bar", "base", point=(-0.12, 0, 0), name="shoulder"),
        sp.HingeJoint("other", "bar", point=(0.125, 0, 0), axis=(0, 0, 1), name="elbow", limits=(-0.05 * p[2], 2.0)),
    ]
    return sp.Scene([base, one, other], pins=[sp.Pin("base")], joints=joints)


def tail():
    rubber = sp.StableNeoHookean(youngs=5e4, density=800, poisson=0.3)
    return sp.Body("tail", sp.shapes.box((0.2, 0.1, 0.1), (2, 1, 1)), rubber, position=(0.305, 0, 0))


def stitched(p):
    body = bar(p[0], p[1])
    stitch = sp.SoftVertexTriangleStitch(
        "tail",
        "bar",
        max_distance=0.01,
        youngs=2e5 * p[2],
        poisson=0.3,
        min_separate_distance=0.002,
        damping=0.01 * p[3],
    )
    return sp.Scene([body, tail()], pins=[sp.Pin("bar", end(body, -1))], stitches=[stitch])


def sewn(p):
    body = bar(p[0], p[1])
    stitch = sp.VertexVertexStitch("tail", "bar", max_distance=0.01, stiffness=100 * p[2], damping=0.02 * p[3])
    return sp.Scene([body, tail()], pins=[sp.Pin("bar", end(body, -1))], stitches=[stitch])


def held_by_rigid(p):
    """A bar that is welded to a rigid block, to which a tail is stitched."""
    body = bar(p[0], p[1])
    block = sp.RigidBody(
        "block", sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1)), density=1000 * p[2], position=(-0.25, 0, 0)
    )
    weld = sp.Weld("bar", "block", end(body, -1))
    loose = replace(tail(), position=(-0.405, 0, 0))
    stitch = sp.VertexVertexStitch("tail", "block", max_distance=0.01, stiffness=100 * p[3])
    pins = [sp.Pin("tail", end(loose, -1))]
    return sp.Scene([body, block, loose], pins=pins, welds=[weld], stitches=[stitch])


def hollow(p, **content):
    mesh = sp.shapes.spherical_shell(0.03, 0.05, edge_length=0.03)
    rubber = sp.StableNeoHookean(youngs=1e5 * p[0], density=1000 * p[1], poisson=0.4, damping=0.01)
    return sp.Scene([sp.Body("bar", mesh, rubber)], cavities=[sp.Cavity("bar", **content)])


def inflated(p):
    return hollow(p, pressure=lambda t: 1e4 * p[2] * ramp(t))


def filled(p):
    return hollow(p, volume=lambda t: 9.8785e-5 * (1 + 0.3 * p[2] * ramp(t)))


def tendon(p):
    body = bar(p[0], p[1], damping=0.01)
    x = body.mesh.vertices
    top = np.flatnonzero((x[:, 1] > 0.04) & (x[:, 2] > 0.04)).tolist()

    def length(t):
        return 0.4 * (1 - 0.05 * p[2] * ramp(t))

    cable = sp.Cable([("bar", i) for i in top], length=length, stiffness=1000 * p[3])
    return sp.Scene([body], pins=[sp.Pin("bar", end(body, -1))], cables=[cable])


def muscle(p):
    body = bar(p[0], p[1], damping=0.01)
    curve = ([0.5, 0.95, 1.05, 1.6], [0.0, 1.0, 1.0, 0.0])
    fibres = sp.Muscle("bar", 2e4 * p[2], (1, 0, 0), ramp, force_length=curve)
    return sp.Scene([body], pins=[sp.Pin("bar", end(body, -1))], loads=[fibres])


def viscoelastic(p):
    rubber = sp.StableNeoHookean(youngs=1e5 * p[0], density=1000 * p[1], poisson=0.35)
    law = sp.Viscoelastic(material=rubber, prony=[(0.4 * p[2], 0.05 * p[3])])
    body = sp.Body("bar", sp.shapes.box((0.4, 0.1, 0.1), (4, 1, 1)), law)
    return sp.Scene([body], pins=[sp.Pin("bar", end(body, -1))])


def tumbling(p):
    body = sp.RigidBody(
        "bar",
        sp.shapes.box((0.2, 0.1, 0.1), (2, 1, 1)),
        density=1000 * p[0],
        velocity=(0.3 * p[1], 0, 0),
        angular_velocity=(0, 2 * p[2], 1),
    )
    return sp.Scene([body], gravity=(0, -9.81 * p[3], 0))


def hinged(p, motor=None, **resistance):
    base = sp.RigidBody("base", sp.shapes.box((0.1, 0.1, 0.1), (1, 1, 1)), density=1000.0, position=(-0.2, 0, 0))
    arm = sp.RigidBody("bar", sp.shapes.box((0.2, 0.06, 0.06), (2, 1, 1)), density=500 * p[0])
    hinge = sp.HingeJoint("bar", "base", point=(-0.11, 0, 0), axis=(0, 0, 1), motor=motor, name="elbow", **resistance)
    return sp.Scene([base, arm], pins=[sp.Pin("base")], joints=[hinge])


def hinge(p):
    return hinged(p, damping=0.05 * p[1], friction=0.05 * p[2])


def driven_to(p):
    motor = sp.PositionMotor(lambda t: 0.5 * p[1] * ramp(t), stiffness=20 * p[2], damping=0.3 * p[3])
    return hinged(p, motor)


def driven_at(p):
    return hinged(p, sp.VelocityMotor(2.0 * p[1]))
