"""The constraints of shells: the membrane of each triangle as one block, and the angle of each hinge.

Membrane. A projection of a triangle minimizes, over the motion of its corners, m/2 |dx|^2 / h^2 + V psi. With the
metric K = sum w_i b_i b_i^T of F, P = d psi/dF, dF = -h^2 V P K. In the principal directions of C = F^T F, with
D_a = K_aa + |K_12| >= K, that is sigma_a + h^2 V D_a d psi/d sigma_a = s_a for the two principal stretches: the
unknowns of Newton's method, from what a linear law would give, so that no stiffness overshoots.

Bending. The moments m of hinges solve W m = turned, see `supple.materials.shells.elements`: all hinges are coupled, and
one sweep over them from zero would not deliver W^-1, however short a substep is. So W^-1, whose factorization is known,
acts every few substeps on the angles theta_n that projections have left then, and each hinge alone resists the rest:

    m = W^-1 (theta_n - theta_0) + D (theta - theta_n),    D diagonal, D >= W^-1: `ShellElements.hinge_stiffness`.

That majorizes the energy and touches it at theta_n. Equilibria are those of W. A projection is that of one constraint
of the compliance 1/D.

Damping. A stress tau dE/dt, and moments tau W^-1 d theta/dt, are added in projections, with rates against what the
projections of the substep before have left: what these leave and what others change after them differs, and in a body
that carries a load only the first stays. Moments are those of the velocities at the beginning, and D resists changes.
What a substep keeps rigid has no rate of strain: see `damping.elements`. XPBD itself damps like tau = h.

Source of the projection: Macklin, Müller, Chentanez, "XPBD" (2016); of majorization: Hunter, Lange, "A Tutorial on MM
Algorithms" (2004).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from supple.materials.shells.elements import ShellElements
from supple.materials.shells.hinges import angles_of, hinge_products, turns_of
from supple.materials.shells.kernels import strains_of
from supple.model.system import System
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.sweeps.groups import FLAGS, WIDTH, make_groups, nine, put_nine, put_twelve, twelve
from supple.solvers.xpbd.sweeps.ordering import Layout
from supple.solvers.xpbd.sweeps.sweep import Sweep

Floats = NDArray[np.float64]

# Of Newton's method in the two stretches. From the linear guess, stretches of .05 to 3 are within 1 % with two of them.
STEPS = 2
# Substeps from one look at all angles to the next.
CYCLE = 4
# Of a stretch: what a Newton step leaves of it at least, so that the area of a triangle stays positive.
LEAST_LEFT = 0.2


class MembraneConstraints:
    """The triangles of all shells.

    Parameters
    ----------
    system, layout : in the solver's numbering
    """

    def __init__(self, system: System, shells: ShellElements, layout: Layout) -> None:
        w = system.inverse_masses[shells.triangles]
        rows = np.flatnonzero((w > 0.0).any(axis=1))
        triangles, w, b = shells.triangles[rows], w[rows], shells.gradients[rows]
        # The law is isotropic, so that each triangle may have its own axes: those in which K is diagonal.
        metric, axes = np.linalg.eigh(np.einsum("tp,tpi,tpj->tij", w, b, b))
        axes[np.linalg.det(axes) < 0.0, :, 0] *= -1.0
        stiffness = (shells.areas * shells.thickness * shells.mu)[rows]
        # A direction in which nothing can move has a metric of zero.
        metric = np.maximum(metric, 1e-12 * metric[:, 1:])
        law = np.column_stack([stiffness, shells.a[rows], shells.neo_hookean[rows].astype(np.float64)])
        tau = shells.damping[rows, None]
        constants = np.hstack([(b @ axes)[:, 1:].reshape(-1, 4), metric, law, w, tau, np.zeros((len(rows), 3))])
        self._triangles, self._gradients = np.ascontiguousarray(triangles), np.ascontiguousarray(b @ axes)
        self.count, self.work = len(rows), 3 * len(rows)
        self.sweep = Sweep(_project_membranes, triangles, constants, make_groups(layout, triangles))

    def begin_frame(self, x: Floats, known: Floats | None) -> None:
        """See `ElementStage`; (t, 3) strains 11, 22, 12."""
        if known is None or known.shape != (self.count, 3):
            self.sweep.write(13, strains_of(x, self._triangles, self._gradients))
        else:
            self.sweep.write(13, known)

    def begin(self, x: Floats, v: Floats, h: float) -> None:
        """See `ElementStage`."""

    def memory(self) -> Floats:
        """See `ElementStage`."""
        return self.sweep.read(13, 3)

    def project(self, points: Floats, h: float) -> None:
        """See `ConstraintSet.project`."""
        self.sweep.run(points, h)


class HingeConstraints:
    """The hinges of all shells, see `MembraneConstraints`."""

    def __init__(self, system: System, shells: ShellElements, layout: Layout) -> None:
        w = system.inverse_masses[shells.hinges]
        # Two triangles with three common corners have hinges between a vertex and itself, which cannot turn.
        moves = (w > 0.0).any(axis=1) & (shells.hinges[:, 2] != shells.hinges[:, 3])
        self._rows, self._held = np.flatnonzero(moves), np.flatnonzero(~moves)
        self._held_hinges = np.ascontiguousarray(shells.hinges[self._held])
        hinges, w, self._shells = shells.hinges[self._rows], w[self._rows], shells
        self.count, self.work = len(hinges), 3 * len(hinges)
        if self.count:
            self._stiffness = shells.hinge_stiffness
            self._ratios = shells.ratios(system.rest_positions, system.inverse_masses[shells.hinges])
            constants = np.column_stack([w, self._stiffness[self._rows], np.zeros((self.count, 5))])
            self.sweep = Sweep(_project_hinges, hinges, constants, make_groups(layout, hinges))
            self._angles, self._is_damped = np.zeros(len(shells.hinges)), bool(shells.hinge_damping.any())
            self._substep = 0

    def begin_frame(self, x: Floats, known: Floats | None) -> None:
        """See `ElementStage`; (e,) angles."""
        if known is None or known.shape != (len(self._shells.hinges),):
            known = angles_of(x, self._shells.hinges)
        self._angles, self._substep = known.copy(), 0

    def begin(self, x: Floats, v: Floats, h: float) -> None:
        """See `ElementStage`."""
        self._substep += 1
        if self._substep % CYCLE != 1:
            return
        if self._substep > 1:
            self._angles = self.memory()
        shells, D = self._shells, self._stiffness
        if len(self._held):
            self._angles[self._held] = angles_of(x, self._held_hinges)
        turned, viscosity, more = self._angles - shells.rest_angles, np.zeros(len(D)), 0.0
        if self._is_damped:
            tau = np.maximum(shells.hinge_damping - h, 0.0) / (1.0 + h * h * self._ratios) ** 2
            changes = np.empty(len(D))
            hinge_products(turns_of(x, shells.hinges), shells.hinges, v, changes)
            changes *= tau
            turned, viscosity, more = turned + changes, D * tau / h, D * changes
        moments = shells.moments(turned) - more
        columns = moments, np.sin(self._angles), np.cos(self._angles), np.zeros(len(D)), viscosity
        self.sweep.write(5, np.column_stack(columns)[self._rows])

    def memory(self) -> Floats:
        """See `ElementStage`."""
        out = self._angles.copy()
        out[self._rows] += self.sweep.read(8, 1)[:, 0]
        return out

    def project(self, points: Floats, h: float) -> None:
        """See `ConstraintSet.project`."""
        self.sweep.run(points, h)


def shell_constraints(system: System, layout: Layout) -> list[MembraneConstraints | HingeConstraints]:
    """The constraints that the shells of a system need, in the solver's numbering."""
    if system.shells is None:
        return []
    made = [kind(system, system.shells, layout) for kind in (MembraneConstraints, HingeConstraints)]
    return [constraints for constraints in made if constraints.count]


@njit(fastmath=FLAGS, forceinline=True)
def _power(x, a):
    """x^-a, for vector units: the sixteenth power of Padé's approximant [2/2] of y^-a at y = x^(1/16).

    Its relative error is below 5e-9 for x from .5 to 2, and below 4e-7 for x from .2 to 5.
    """
    r = math.sqrt(math.sqrt(math.sqrt(math.sqrt(x)))) - 1.0
    over = 1.0 + (1.0 - 0.5 * a) * r + (2.0 - a) * (1.0 - a) / 12.0 * r * r
    y = over / (1.0 + (1.0 + 0.5 * a) * r + (2.0 + a) * (1.0 + a) / 12.0 * r * r)
    y *= y
    y *= y
    y *= y
    return y * y


@njit(fastmath=FLAGS, forceinline=True)
def _newton_step(p, q, s1, s2, d1, d2, law, beta, e1, e2):
    """One step from the stretches p, q; returns the new ones, and the forces on them.

    Parameters
    ----------
    s1, s2 : stretches before the projection; d1, d2 : h^2 D_a; law : mu V, a, 1 where neo-Hookean
    beta : tau / h; e1, e2 : strains with which rates are found
    """
    mu, a, neo_hookean = law
    c1, c2 = p * p, q * q
    if neo_hookean > 0.0:
        power = mu * _power(c1 * c2, a)
        t1, t2 = mu - power / c1, mu - power / c2
        h11, h22, h12 = 2.0 * (1.0 + a) * power / c1, 2.0 * (1.0 + a) * power / c2, 2.0 * a * power / (p * q)
    else:
        r1, r2 = c1 - 1.0, c2 - 1.0
        t1, t2 = mu * (r1 + a * (r1 + r2)), mu * (r2 + a * (r1 + r2))
        h11, h22, h12 = 2.0 * mu * (1.0 + a) * c1, 2.0 * mu * (1.0 + a) * c2, 2.0 * mu * a * (p * q)
    v, r1, r2 = 2.0 * mu * beta, 0.5 * (c1 - 1.0) - e1, 0.5 * (c2 - 1.0) - e2
    t1, t2 = t1 + v * (r1 + a * (r1 + r2)), t2 + v * (r2 + a * (r1 + r2))
    h11, h22 = h11 + v * (1.0 + a) * c1 + max(t1, 0.0), h22 + v * (1.0 + a) * c2 + max(t2, 0.0)
    h12 += v * a * (p * q)
    g1, g2 = p - s1 + d1 * p * t1, q - s2 + d2 * q * t2
    # (1 + diag(d) H) step = -g
    a11, a12, a21, a22 = 1.0 + d1 * h11, d1 * h12, d2 * h12, 1.0 + d2 * h22
    det = a11 * a22 - a12 * a21
    u, w = (a12 * g2 - a22 * g1) / det, (a21 * g1 - a11 * g2) / det
    return (
        max(p + u, LEAST_LEFT * p),
        max(q + w, LEAST_LEFT * q),
        p * t1 + h11 * u + h12 * w,
        q * t2 + h12 * u + h22 * w,
    )


@njit(fastmath=FLAGS, forceinline=True)
def project_membrane(x, b, k, law, w, tau, e, h):
    """The 9 coordinates of the corners of a triangle after its projection, and its strains 11, 22, 12 then.

    Parameters
    ----------
    b : shape gradients of its corners 1 and 2 [1/m]; k : diagonal of K [1/(kg m^2)]; law : see `_newton_step`
    w : inverse masses [1/kg]; tau : [s]; e : strains 11, 22, 12 with which rates are found
    """
    x0, y0, z0, x1, y1, z1, x2, y2, z2 = x
    b10, b11, b20, b21 = b
    ux, uy, uz, vx, vy, vz = x1 - x0, y1 - y0, z1 - z0, x2 - x0, y2 - y0, z2 - z0
    fx, fy, fz = ux * b10 + vx * b20, uy * b10 + vy * b20, uz * b10 + vz * b20
    gx, gy, gz = ux * b11 + vx * b21, uy * b11 + vy * b21, uz * b11 + vz * b21
    c1, c2, c12 = fx * fx + fy * fy + fz * fz, gx * gx + gy * gy + gz * gz, fx * gx + fy * gy + fz * gz
    nx, ny, nz = fy * gz - fz * gy, fz * gx - fx * gz, fx * gy - fy * gx
    half = 0.5 * (c1 - c2)
    r = math.sqrt(half * half + c12 * c12)
    cos, sin = (half / r, c12 / r) if r > 0.0 else (1.0, 0.0)
    high = max(0.5 * (c1 + c2) + r, 1e-24)
    s1, s2 = math.sqrt(high), math.sqrt(max((nx * nx + ny * ny + nz * nz) / high, 1e-24))
    h2, middle, spread, side = h * h, 0.5 * (k[0] + k[1]), 0.5 * (k[0] - k[1]) * cos, abs(0.5 * (k[0] - k[1]) * sin)
    d1, d2 = h2 * (middle + spread + side), h2 * (middle - spread + side)
    stiff = 2.0 * law[0] * (1.0 + law[1])
    beta = max(tau - h, 0.0) / h / (1.0 + max(d1, d2) * stiff) ** 2
    mean, change, across = 0.5 * (e[0] + e[1]), 0.5 * (e[0] - e[1]), e[2]
    across, change = across * cos - change * sin, change * cos + across * sin
    e1, e2 = mean + change, mean - change
    # Stiffness pulls to a stretch of 1, viscosity to that before.
    u, v = d1 * stiff, d2 * stiff
    before, other = math.sqrt(max(1.0 + 2.0 * e1, 0.0)), math.sqrt(max(1.0 + 2.0 * e2, 0.0))
    p, q = (s1 + u + beta * u * before) / (1.0 + u + beta * u), (s2 + v + beta * v * other) / (1.0 + v + beta * v)
    t1, t2 = 0.0, 0.0
    for _ in range(STEPS):
        p, q, t1, t2 = _newton_step(p, q, s1, s2, d1, d2, law, beta, e1, e2)
    t1, t2 = h2 * t1 / s1, h2 * t2 / s2
    side = beta * law[0] * (d1 * s2 * s2 + d2 * s1 * s1)
    t12 = -2.0 * h2 * beta * law[0] * across / (1.0 + side)
    mean, change, across = 0.25 * (p * p + q * q) - 0.5, 0.25 * (p * p - q * q), across * side / (1.0 + side)
    e = mean + change * cos - across * sin, mean - change * cos + across * sin, change * sin + across * cos
    half, mid = 0.5 * (t1 - t2), 0.5 * (t1 + t2)
    s11, s22, s12 = mid + half * cos - t12 * sin, mid - half * cos + t12 * sin, half * sin + t12 * cos
    ax, ay, az = fx * s11 + gx * s12, fy * s11 + gy * s12, fz * s11 + gz * s12
    bx, by, bz = fx * s12 + gx * s22, fy * s12 + gy * s22, fz * s12 + gz * s22
    px, py, pz = ax * b10 + bx * b11, ay * b10 + by * b11, az * b10 + bz * b11
    qx, qy, qz = ax * b20 + bx * b21, ay * b20 + by * b21, az * b20 + bz * b21
    x = (
        x0 + w[0] * (px + qx),
        y0 + w[0] * (py + qy),
        z0 + w[0] * (pz + qz),
        x1 - w[1] * px,
        y1 - w[1] * py,
        z1 - w[1] * pz,
        x2 - w[2] * qx,
        y2 - w[2] * qy,
        z2 - w[2] * qz,
    )
    return x, e


@njit(fastmath=FLAGS, forceinline=True)
def _project_membranes(X, data, g, h):
    """The rows of `data`: b (4), k (2), mu V, a, law, 3 inverse masses, tau, 3 strains: new ones then."""
    for i in range(WIDTH):
        b = (data[g, 0, i], data[g, 1, i], data[g, 2, i], data[g, 3, i])
        k, law = (data[g, 4, i], data[g, 5, i]), (data[g, 6, i], data[g, 7, i], data[g, 8, i])
        w = (data[g, 9, i], data[g, 10, i], data[g, 11, i])
        e = (data[g, 13, i], data[g, 14, i], data[g, 15, i])
        x, e = project_membrane(nine(X, i), b, k, law, w, data[g, 12, i], e, h)
        put_nine(X, i, x)
        data[g, 13, i], data[g, 14, i], data[g, 15, i] = e


@njit(fastmath=FLAGS, forceinline=True)
def _angle(sine, cosine):
    """The angle of (cosine, sine), of any length, for vector units: eight times the arc tangent of its eighth."""
    t = sine / max(math.sqrt(sine * sine + cosine * cosine) + cosine, 1e-300)
    t = t / (1.0 + math.sqrt(1.0 + t * t))
    t = t / (1.0 + math.sqrt(1.0 + t * t))
    u = t * t  # at most .04
    series = 1.0 / 9.0 - u * (1.0 / 11.0 - u * (1.0 / 13.0 - u * (1.0 / 15.0 - u / 17.0)))
    return 8.0 * t * (1.0 - u * (1.0 / 3.0 - u * (1.0 / 5.0 - u * (1.0 / 7.0 - u * series))))


@njit(fastmath=FLAGS, forceinline=True)
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(fastmath=FLAGS, forceinline=True)
def _cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(fastmath=FLAGS, forceinline=True)
def project_hinge(x, w, D, moment, sine, cosine, before, viscosity, h2):
    """The 12 coordinates of a hinge after its projection, and what it has been turned from an angle then.

    Parameters
    ----------
    w : inverse masses [1/kg]; D : see the module; moment : at the angle of `sine` and `cosine` [N m]
    before : what it had been turned by the projection before; viscosity : D tau / h
    """
    x0, y0, z0, x1, y1, z1, x2, y2, z2, x3, y3, z3 = x
    e, u, v = (x1 - x0, y1 - y0, z1 - z0), (x2 - x0, y2 - y0, z2 - z0), (x3 - x0, y3 - y0, z3 - z0)
    n, m = _cross(e, u), _cross(v, e)
    square, nn, mm = _dot(e, e), max(_dot(n, n), 1e-300), max(_dot(m, m), 1e-300)
    length = math.sqrt(square)
    s, c = _dot(_cross(n, m), e), length * _dot(n, m)
    change = _angle(s * cosine - c * sine, c * cosine + s * sine)
    # The gradients by the wings, and the places of these along the edge; see `supple.materials.shells.hinges`.
    f, g, p, q = -length / nn, -length / mm, _dot(u, e) / square, _dot(v, e) / square
    kx, ky, kz, lx, ly, lz = f * n[0], f * n[1], f * n[2], g * m[0], g * m[1], g * m[2]
    ax, ay, az = (p - 1.0) * kx + (q - 1.0) * lx, (p - 1.0) * ky + (q - 1.0) * ly, (p - 1.0) * kz + (q - 1.0) * lz
    bx, by, bz = -p * kx - q * lx, -p * ky - q * ly, -p * kz - q * lz
    G = w[0] * (ax * ax + ay * ay + az * az) + w[1] * (bx * bx + by * by + bz * bz)
    G += w[2] * square / nn + w[3] * square / mm
    t = -h2 * (moment + D * change + viscosity * (change - before)) / (1.0 + h2 * (D + viscosity) * G)
    a, b, k, l = t * w[0], t * w[1], t * w[2], t * w[3]  # noqa: E741
    return (
        x0 + a * ax,
        y0 + a * ay,
        z0 + a * az,
        x1 + b * bx,
        y1 + b * by,
        z1 + b * bz,
        x2 + k * kx,
        y2 + k * ky,
        z2 + k * kz,
        x3 + l * lx,
        y3 + l * ly,
        z3 + l * lz,
        change + t * G,
    )


@njit(fastmath=FLAGS, forceinline=True)
def _project_hinges(X, data, g, h):
    """The rows of `data`: 4 inverse masses, and D, moment, sine, cosine, before and viscosity of `project_hinge`."""
    for i in range(WIDTH):
        w, D = (data[g, 0, i], data[g, 1, i], data[g, 2, i], data[g, 3, i]), data[g, 4, i]
        at = data[g, 5, i], data[g, 6, i], data[g, 7, i], data[g, 8, i], data[g, 9, i]
        x = project_hinge(twelve(X, i), w, D, at[0], at[1], at[2], at[3], at[4], h * h)
        put_twelve(X, i, x)
        data[g, 8, i] = x[12]
