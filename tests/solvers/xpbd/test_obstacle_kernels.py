"""Cached kernels of obstacles from several processes do not interfere."""

import os
import subprocess
import sys

import pytest

PUSH = """
import sys
import numpy as np
import supple as sp
from supple.scene.registry import KINDS
from supple.solvers.xpbd.contact.movers import Movers
from supple.solvers.xpbd.contact.shape_kernels import kernels_of

for name in sys.argv[1:]:
    obstacle = sp.obstacles.Sphere(radius=0.5, inside=True) if name == "Sphere" else KINDS[name](inside=True)
    (shape,) = obstacle.shapes()
    x = np.array([[0.55, 0.1, 0.0]])
    numbers = np.zeros((1, 4))
    numbers[0, : len(shape.parameters)] = shape.parameters
    arrays = (numbers, np.zeros(1, dtype=np.bool_))
    rules = (np.zeros(1, np.int32), np.ones((1, 1), np.bool_), np.zeros((1, 1)))
    found = (np.array([0, 1]), np.zeros(1, np.int32), np.zeros((1, 3)), np.zeros(1), np.zeros((1, 4)))
    frames = shape.frame[None]
    none = np.zeros((0, 3))
    body = np.full(1, -1, dtype=np.int32)
    nobody = (np.zeros(0), np.zeros((0, 3, 3)), np.zeros(0), np.zeros((0, 9)), none)
    movers = Movers(np.ones(1), body, np.zeros((1, 3)), *nobody)
    points = (x.copy(), np.zeros(1), movers, x.copy())
    ends = (0, 1, 1.0, 1.0, (0.0, 1.0), 1)
    kernels_of(shape.contact)[1](x, x.copy(), points, found, arrays, rules, frames, frames, *ends)
    print(name, *np.round(x[0], 6) + 0.0)
"""
PUSHED = {
    "Sphere": "Sphere 0.491935 0.089443 0.0",
    "Capsule": "Capsule 0.5 0.1 0.0",
    "Cylinder": "Cylinder 0.5 0.1 0.0",
}


@pytest.fixture
def push(tmp_path):
    def push(*names):
        environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
        command = [sys.executable, "-c", PUSH, *names]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=200, check=True)
        return done.stdout.splitlines()

    return push


@pytest.mark.slow
def test_cached_kernels_of_several_processes_do_not_interfere(push):
    for name in ("Sphere", "Cylinder"):
        assert push(name) == [PUSHED[name]]
    assert push("Cylinder", "Sphere") == [PUSHED["Cylinder"], PUSHED["Sphere"]]
    assert push("Sphere", "Cylinder", "Capsule") == [PUSHED[name] for name in ("Sphere", "Cylinder", "Capsule")]
