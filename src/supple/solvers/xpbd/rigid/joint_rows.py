"""The rows of joints in a substep: every one is a law along a function g of the control points of two bodies.

An impulse p [kg m] of a row with the gradient G (see `supple.model.joints`) has on each body the force sum G_k and the
moment sum r_k x G_k about the center, with the arms r_k of the beginning of the substep, and moves the body by its
inverse mass and inertia: by p M^-1 J^T. Its inverse mass is J M^-1 J^T. A law psi' = clip(lambda + k (g - g0), low,
high) is p = -h^2 psi', which is

    g - g0 + (lambda h^2 + p) / (h^2 k) = 0,    -h^2 high <= p <= -h^2 low,

with an infinite k where it is a condition, a limit or a velocity, and p = -h^2 lambda where k is zero. Sweeps solve
these equations one after the other. Multipliers begin at zero in each substep, and only the impulse in total has ends:
laws take back what they have pushed too much. Otherwise a push of a contact that sweeps reduce later would leave
energy. A difference of the two sides that vanishes is three conditions, along the axes of the world.

Where the two sides of a joint are apart, its forces have a moment. It is taken away from both bodies alike, so that
two free bodies keep their angular momentum.

Source: Müller, Macklin, Chentanez, Jeschke, Kim, "Detailed Rigid Body Simulation with Extended Position Based Dynamics"
(2020), section 3.3.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from supple.model.joints.functions import is_own, value_at
from supple.model.joints.laws import LAW, begin_law, wrapped
from supple.numerics.mat3 import cross, row
from supple.runtime.kernel_cache import njit

# Of the largest inverse mass of the joint's rows: rows that move less follow from the others.
_IDLE = 1e-5

_near_zero = njit(wrapped)

_REAL = np.float64
# Its control points, and the coefficients of its point; whether its second side is an obstacle that moves; the forces
# of the substep on the control points [N]. Sums of the frame: force on the first side and torque about the point;
# effort of the motor; what a velocity motor below its largest effort lacks, and its way, in units of its function.
JOINT = np.dtype(
    [
        ("corners", np.int64, 8),
        ("center", _REAL, 8),
        ("driven", np.bool_),
        ("on_corners", _REAL, (8, 3)),
        ("total", _REAL, 6),
        ("effort", _REAL),
        ("lacking", _REAL),
        ("way", _REAL),
    ],
    align=True,
)
# Its place in `FORMS`; coefficients of its vectors a, b, d and f; the change that counts as much as a motion by the
# joint's size; whether it is an angle, followed over all turns. Values where the substep began and at present, and the
# gradient by the control points; value and gradient by the vectors where they are found in Python.
FUNCTION = np.dtype(
    [
        ("form", np.int64),
        ("joint", np.int64),
        ("coefficients", _REAL, (4, 8)),
        ("unit", _REAL),
        ("turns", np.bool_),
        ("begun", _REAL),
        ("now", _REAL),
        ("gradient", _REAL, (8, 3)),
        ("given", _REAL),
        ("given_gradient", _REAL, (4, 3)),
    ],
    align=True,
)
# A law, and its impulses of the substep so far [kg m]; whether it is one of a difference; the bodies, -1 for none that
# moves. Linearized: J^T, force and moment on each body for a unit impulse; M^-1 J^T; J M^-1 J^T [1/kg], zero where the
# row is idle; g - g0 [m]; 1 / (h^2 k) [1/kg]; ends of the impulse [kg m], and the impulse since then.
ROW = np.dtype(
    [
        ("law", LAW),
        ("pushed", _REAL),
        ("is_difference", np.bool_),
        ("joint", np.int64),
        ("size", _REAL),
        ("bodies", np.int64, 2),
        ("actions", _REAL, (2, 6)),
        ("answers", _REAL, (2, 6)),
        *((name, _REAL) for name in ("total", "missing", "compliance", "least", "most", "impulse")),
    ],
    align=True,
)


class Joints(NamedTuple):
    """The joints of a frame of t substeps, as kernels take them.

    Attributes
    ----------
    joints : (j,) of `JOINT`; functions : (s,) of `FUNCTION`; rows : (r,) of `ROW`
    offsets : (t + 1, s, 4, 3) of the functions' vectors about the origin of places [m], where substeps begin, and where
        the last one ends
    step, given : (t, r) see `Law`
    """

    joints: NDArray[np.void]
    functions: NDArray[np.void]
    rows: NDArray[np.void]
    offsets: NDArray[np.float64]
    step: NDArray[np.float64]
    given: NDArray[np.float64]


@njit
def _evaluate(joints, functions, offsets, x):
    """Set values and gradients of the functions at places x (N, >= 3)."""
    q, dc, ds = np.zeros((4, 3)), np.zeros((4, 3)), np.zeros((4, 3))
    for s in range(len(functions)):
        f = functions[s]
        corners = joints[f.joint].corners
        u, w, value = 0.0, 1.0, f.given
        if is_own(f.form):
            for a in range(4):
                for i in range(3):
                    q[a, i] = offsets[s, a, i]
                    for p in range(8):
                        q[a, i] += f.coefficients[a, p] * x[corners[p], i]
            value, u, w = value_at(f.form, q, dc, ds)
        f.now = f.begun + _near_zero(value - f.begun) if f.turns else value
        for p in range(8):
            for i in range(3):
                f.gradient[p, i] = 0.0
                for a in range(4):
                    slope = u * ds[a, i] + w * dc[a, i] if is_own(f.form) else f.given_gradient[a, i]
                    f.gradient[p, i] += f.coefficients[a, p] * slope


@njit
def begin_rows(joints, functions, rows, step, given):
    """Begin a substep: the laws, without impulses."""
    for k in range(len(rows)):
        r = rows[k]
        begin_law(r.law, step[k], given[k], functions[r.law.function].begun)
        r.pushed = 0.0
    for k in range(len(joints)):
        joints[k].on_corners[:] = 0.0


@njit(forceinline=False)
def linearize(joints, functions, rows, offsets, x, begin, arms, w, J, h):
    """Set the rows at places x (N, >= 3), in a substep of h [s] that began at `begin` (N, 3).

    arms : (N, 3) of the control points; w, J : (b,), (b, 3, 3) inverse masses and inertia; see `Bodies`
    """
    _evaluate(joints, functions, offsets, x)
    largest, excess = np.zeros(len(joints)), np.zeros(3)
    for k in range(len(rows)):
        r = rows[k]
        law, f, corners = r.law, functions[r.law.function], joints[r.joint].corners
        low, high, r.compliance = law.low, law.high, 0.0
        if not law.adapts and law.k > 0.0:
            r.compliance = 1.0 / (h * h * law.k)
        elif not law.adapts:
            low = high = law.multiplier
        r.least, r.most = -h * h * high - r.pushed, -h * h * low - r.pushed
        r.missing = f.now - law.start + r.compliance * (h * h * law.multiplier + r.pushed)
        r.impulse, r.total, both = 0.0, 0.0, r.bodies[0] >= 0 and r.bodies[1] >= 0
        excess[:] = 0.0
        for side in range(2):
            r.actions[side, :] = 0.0
            for p in range(4 * side, 4 * side + 4):
                G = row(f.gradient, p)
                moment, about = cross(row(arms, corners[p]), G), cross(row(begin, corners[p]), G)
                for i in range(3):
                    r.actions[side, i] += G[i]
                    r.actions[side, 3 + i] += moment[i]
                    excess[i] += about[i]
        for side in range(2):
            b = r.bodies[side]
            r.answers[side, :] = 0.0
            for i in range(3):
                if both:
                    r.actions[side, 3 + i] -= 0.5 * excess[i]
            if b >= 0:
                for i in range(3):
                    r.answers[side, i] = w[b] * r.actions[side, i]
                    for j in range(3):
                        r.answers[side, 3 + i] += J[b, i, j] * r.actions[side, 3 + j]
            for i in range(6):
                r.total += r.actions[side, i] * r.answers[side, i]
        largest[r.joint] = max(largest[r.joint], r.total)
    for k in range(len(rows)):
        if rows[k].total <= _IDLE * largest[rows[k].joint]:
            rows[k].total = 0.0


@njit
def sweep_joints(rows, twists, turn):
    """Sweep once over the rows, forward and backward in turn, in place: impulses, and twists (b, 6) of bodies.

    Returns the largest correction, as a share of the joint's size.
    """
    count, largest = len(rows), 0.0
    for k in range(count):
        r = rows[k if turn % 2 == 0 else count - 1 - k]
        if r.total == 0.0:
            continue
        g = r.missing + r.compliance * r.impulse
        for side in range(2):
            b = r.bodies[side]
            if b >= 0:
                for i in range(6):
                    g += r.actions[side, i] * twists[b, i]
        p = min(max(r.impulse - g / (r.total + r.compliance), r.least), r.most)
        change = p - r.impulse
        r.impulse = p
        largest = max(largest, abs(change) * r.total / r.size)
        for side in range(2):
            b = r.bodies[side]
            if b >= 0:
                for i in range(6):
                    twists[b, i] += r.answers[side, i] * change
    return largest


@njit(forceinline=False)
def note_rows(joints, functions, rows, x, h):
    """Add up the impulses of rows that have been solved; x (N, >= 3) places of the control points."""
    arm = np.zeros(3)
    for k in range(len(rows)):
        r = rows[k]
        joint, f, force = joints[r.joint], functions[r.law.function], r.impulse / (h * h)
        r.pushed += r.impulse
        arm[:] = 0.0
        for p in range(4):
            for i in range(3):
                arm[i] += (joint.center[p] - 0.25) * x[joint.corners[p], i]
        turned = cross(arm, row(r.actions, 0))
        for i in range(3):
            joint.total[i] += force * r.actions[0, i]
            joint.total[3 + i] += force * (r.actions[0, 3 + i] - turned[i])
            for p in range(8):
                joint.on_corners[p, i] += force * f.gradient[p, i]
        if r.law.is_motor:
            joint.effort += force


@njit(cache=True)
def end_substep(joints, functions, rows, offsets, x, begin, h):
    """End a substep of h [s] at places x (N, >= 3); returns the work on the bodies in it [J].

    Conditions between bodies do none: what one side gives, the other takes.
    """
    _evaluate(joints, functions, offsets, x)
    work = 0.0
    for k in range(len(rows)):
        r = rows[k]
        law, f, joint, force = r.law, functions[r.law.function], joints[r.joint], r.pushed / (h * h)
        if law.is_motor and law.adapts and law.low < -force < law.high:
            joint.lacking += (law.start - f.now) / f.unit
            joint.way += (law.start - f.begun) / f.unit
        if not joint.driven and not r.is_difference:
            work += force * (f.now - f.begun)
    for k in range(len(joints)):
        joint = joints[k]
        for p in range(8 if joint.driven else 0):
            for i in range(3):
                work += joint.on_corners[p, i] * (x[joint.corners[p], i] - begin[joint.corners[p], i])
    for s in range(len(functions)):
        functions[s].begun = functions[s].now
    return work
