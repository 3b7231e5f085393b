"""The viscosity matrices of single elements, made of the forces of unit velocities."""

import numpy as np

from supple.runtime.kernel_cache import njit, prange
from supple.solvers.xpbd.damping.forces import softened, viscous_spring, viscous_tet


def matrices_of_tets(points, vertices, constants, h):
    """(m, 12, 12) of tets at positions `points` [kg/s]; `constants` as in `ViscousTets.constants`."""
    out = np.empty((len(vertices), 12, 12))
    _fill_tets(points, vertices, constants, h, out)
    return out


def matrices_of_springs(points, vertices, constants, h):
    """(m, 9, 9) of springs; `constants` as in `ViscousSprings.constants`."""
    out = np.empty((len(vertices), 9, 9))
    _fill_springs(points, vertices, constants, h, out)
    return out


@njit(cache=True, parallel=True)
def _fill_tets(points, vertices, constants, h, out):
    for e in prange(len(vertices)):
        c = constants[e]
        a, b, d, q = points[vertices[e, 0]], points[vertices[e, 1]], points[vertices[e, 2]], points[vertices[e, 3]]
        x = (a[0], a[1], a[2], b[0], b[1], b[2], d[0], d[1], d[2], q[0], q[1], q[2])
        gradients = (c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8])
        tau = max(c[12] - h, 0.0)
        v = np.zeros(12)
        for k in range(12):
            v[:] = 0.0
            v[k] = 1.0
            unit = (v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8], v[9], v[10], v[11])
            f = viscous_tet(x, unit, gradients, tau * c[9], tau * softened(c[10], c[11], h))
            for j in range(12):
                out[e, j, k] = f[j]


@njit(cache=True, parallel=True)
def _fill_springs(points, vertices, constants, h, out):
    for e in prange(len(vertices)):
        t, stiffness, slope, tau = constants[e, 0], constants[e, 1], constants[e, 2], constants[e, 3]
        a, b, d = points[vertices[e, 0]], points[vertices[e, 1]], points[vertices[e, 2]]
        x = (a[0], a[1], a[2], b[0], b[1], b[2], d[0], d[1], d[2])
        v = np.zeros(9)
        for k in range(9):
            v[:] = 0.0
            v[k] = 1.0
            unit = (v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8])
            f = viscous_spring(x, unit, t, max(tau - h, 0.0) * softened(stiffness, slope, h))
            for j in range(9):
                out[e, j, k] = f[j]
