"""The energies of version 0.1 keep their numbers: stored values of the commit before other materials came.

Of the projected and the true Hessian in F, rows 0 and 4.
"""

import json
import platform
from pathlib import Path

import numpy as np
import pytest

from supple.materials.isotropic import densities, hessians, piolas
from supple.materials.registry import ELASTIC_MATERIALS

STORED = json.loads((Path(__file__).parent / "version_0_1.json").read_text())
# Computed from cofactors instead of stretches since then, which has a quarter of the round-off: 5e-14 before.
OTHER_SUMS = {("StableNeoHookean", "first_piola")}


def numbers(rows):
    return np.array([[float.fromhex(number) for number in row.split()] for row in rows])


@pytest.mark.parametrize("number", range(len(ELASTIC_MATERIALS)))
def test_the_numbers_are_those_of_version_0_1(number):
    name = ELASTIC_MATERIALS[number].__name__
    F, mu, lam = (np.array(STORED[key]) for key in ("F", "mu", "lam"))
    m, kind = len(F), np.full(len(F), number, dtype=np.int32)
    density, P = np.empty(m), np.empty((m, 3, 3))
    hessian, projected = np.empty((2, m, 9, 9))
    densities(F, kind, mu, lam, density)
    piolas(F, kind, mu, lam, P)
    hessians(F, kind, mu, lam, False, hessian)
    hessians(F, kind, mu, lam, True, projected)
    found = {"density": density, "first_piola": P, "hessian": hessian[:, [0, 4]], "projected": projected[:, [0, 4]]}
    for quantity, values in found.items():
        now, stored = values.reshape(m, -1), numbers(STORED[name][quantity])
        sizes = np.abs(stored).max(axis=1, keepdims=True)
        other = (name, quantity) in OTHER_SUMS
        assert (np.abs(now - stored) <= (1e-13 if other else 1e-14) * sizes).all(), quantity
        # The logarithm of Neo-Hookean material is that of the C library; everything else is of the IEEE standard.
        if platform.machine() == "x86_64" and name != "NeoHookean" and not other:
            np.testing.assert_array_equal(now, stored, quantity)
