"""Matrices of viscous elements, column by column."""

import numpy as np

from supple.runtime.threads import numba_threads
from supple.solvers.xpbd.damping.elements import damped_springs, damped_tets
from supple.solvers.xpbd.damping.forces import ViscousElements, viscous_springs, viscous_tets
from supple.solvers.xpbd.sweeps.groups import make_groups_of_one_chunk


class Viscosity:
    """The matrix K of a system, (3n, 3n), by the forces at unit velocities of copies of all elements."""

    def __init__(self, system):
        w = system.inverse_masses
        self.count, self.kinds = len(w), []
        for law, damped in ((viscous_tets, damped_tets), (viscous_springs, damped_springs)):
            vertices, constants = damped(system, w)
            m, k = vertices.shape
            if m:
                copies = np.arange(3 * k * m * k, dtype=np.int32).reshape(-1, k)
                groups = make_groups_of_one_chunk(copies, np.zeros(copies.size, dtype=np.int32), copies.size)
                elements = ViscousElements(law, copies, np.tile(constants, (3 * k, 1)), groups)
                self.kinds.append((elements, vertices))

    def at(self, x, h=0.0):
        """At positions x, in substeps of h."""
        K = np.zeros((self.count, 3, self.count, 3))
        for elements, vertices in self.kinds:
            m, k = vertices.shape
            motion, corner, axis = np.zeros((k, 3, m, k, 10)), np.arange(k), np.arange(3)
            motion[..., :3] = x[vertices]
            motion[corner[:, None], axis, :, corner[:, None], 3 + axis] = 1.0
            with numba_threads(1):
                elements.add(motion.reshape(-1, 10), h, elements.active)
            rows, columns = vertices[:, :, None], vertices.T[:, None, :, None, None]
            np.add.at(K, (rows, axis, columns, axis[:, None, None, None]), motion[..., 6:9])
        return K.reshape(3 * self.count, -1)
