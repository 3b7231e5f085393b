"""The constraints of shells: the membrane of each triangle as one block, and the angle of each hinge.

Membrane. A projection of a triangle minimizes, over the motion of its corners, m/2 |dx|^2 / h^2 + V psi. With the
metric K = sum w_i b_i b_i^T of F, P = d psi/dF, dF = -h^2 V P K. In the principal directions of C = F^T F, with
D_a = K_aa + |K_12| >= K, that is sigma_a + h^2 V D_a d psi/d sigma_a = s_a for the two principal stretches: the
unknowns of Newton's method, from what a linear law would give, so that no stiffness overshoots.

Bending. The moments m of hinges solve W m = turned, see `supple.materials.shells.elements`: all hinges are coupled, and
one sweep over them from zero would not deliver W^-1, however short a substep is. So W^-1, whose factorization is known,
acts on the angles theta_n that the projections of the substep before have left, and each hinge alone resists the rest:

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
from supple.materials.shells.kernels import hinge, strains_of
from supple.model.system import System
from supple.runtime.kernel_cache import njit
from supple.solvers.xpbd.sweeps.groups import FLAGS, WIDTH, make_groups, nine, put_nine, put_twelve, twelve
from supple.solvers.xpbd.sweeps.ordering import Layout
from supple.solvers.xpbd.sweeps.sweep import Sweep

Floats = NDArray[np.float64]

# Of Newton's method in the two stretches. From the linear guess, stretches of .05 to 3 are within 1 % with two of them.
STEPS = 2
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
        fits = known is not None and known.shape == (self.count, 3)
        self.sweep.write(13, known if fits else strains_of(x, self._triangles, self._gradients))

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
            constants = np.column_stack([w, self._stiffness[self._rows], np.zeros((self.count, 2))])
            self.sweep = Sweep(_project_hinges, hinges, constants, make_groups(layout, hinges))
            self._angles, self._is_damped = np.zeros(len(shells.hinges)), bool(shells.hinge_damping.any())

    def begin_frame(self, x: Floats, known: Floats | None) -> None:
        """See `ElementStage`; (e,) angles."""
        if known is None or known.shape != (len(self._shells.hinges),):
            known = angles_of(x, self._shells.hinges)
        self._angles = known.copy()
        self.sweep.write(6, known[self._rows, None])

    def begin(self, x: Floats, v: Floats, h: float) -> None:
        """See `ElementStage`."""
        shells, D = self._shells, self._stiffness
        if len(self._held):
            self._angles[self._held] = angles_of(x, self._held_hinges)
        turned = self._angles - shells.rest_angles
        if self._is_damped:
            tau = np.maximum(shells.hinge_damping - h, 0.0) / (1.0 + h * h * self._ratios) ** 2
            changes = np.empty(len(D))
            hinge_products(turns_of(x, shells.hinges), shells.hinges, v, changes)
            changes *= tau
            moments = shells.moments(turned + changes) - D * changes
            self.sweep.write(4, np.column_stack([D * (1.0 + tau / h), moments])[self._rows])
        else:
            self.sweep.write(5, shells.moments(turned)[self._rows, None])

    def memory(self) -> Floats:
        """See `ElementStage`."""
        return self._angles.copy()

    def project(self, points: Floats, h: float) -> None:
        """See `ConstraintSet.project`."""
        self.sweep.run(points, h)
        self._angles[self._rows] = self.sweep.read(6, 1)[:, 0]


def shell_constraints(system: System, layout: Layout) -> list[MembraneConstraints | HingeConstraints]:
    """The constraints that the shells of a system need, in the solver's numbering."""
    if system.shells is None:
        return []
    made = [kind(system, system.shells, layout) for kind in (MembraneConstraints, HingeConstraints)]
    return [constraints for constraints in made if constraints.count]


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
        power = mu * math.exp(-a * math.log(c1 * c2))
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
def _project_hinges(X, data, g, h):
    """The rows of `data`: 4 inverse masses, D, the moment at the angle that follows, and that angle: a new one then."""
    for i in range(WIDTH):
        x = twelve(X, i)
        angle, a, b, k, l = hinge((x[0], x[1], x[2]), (x[3], x[4], x[5]), (x[6], x[7], x[8]), (x[9], x[10], x[11]))  # noqa: E741
        w = (data[g, 0, i], data[g, 1, i], data[g, 2, i], data[g, 3, i])
        D, change = data[g, 4, i], angle - data[g, 6, i]
        # An angle jumps from pi to -pi where a hinge is folded flat.
        change -= 2.0 * math.pi * round(change / (2.0 * math.pi))
        G = w[0] * (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]) + w[1] * (b[0] * b[0] + b[1] * b[1] + b[2] * b[2])
        G += w[2] * (k[0] * k[0] + k[1] * k[1] + k[2] * k[2]) + w[3] * (l[0] * l[0] + l[1] * l[1] + l[2] * l[2])
        m = -h * h * (data[g, 5, i] + D * change) / (1.0 + h * h * D * G)
        data[g, 6, i] += change + m * G
        p, q, r, s = m * w[0], m * w[1], m * w[2], m * w[3]
        put_twelve(
            X,
            i,
            (
                x[0] + p * a[0],
                x[1] + p * a[1],
                x[2] + p * a[2],
                x[3] + q * b[0],
                x[4] + q * b[1],
                x[5] + q * b[2],
                x[6] + r * k[0],
                x[7] + r * k[1],
                x[8] + r * k[2],
                x[9] + s * l[0],
                x[10] + s * l[1],
                x[11] + s * l[2],
            ),
        )
