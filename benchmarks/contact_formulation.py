"""The sideways force between two aligned cubes: contact as in Supple, and over all pairs with areas (IPC Toolkit).

python -m benchmarks.contact_formulation
"""

from __future__ import annotations

import ipctk
import numpy as np

import supple as sp
from supple.model.system import build_system, initial_state
from supple.solvers.implicit.contact.collisions import Barrier
from supple.solvers.implicit.contact.model import contact_model

SIDE, GAP, DHAT, STIFFNESS = 0.1, 5e-5, 1e-4, 1e5
SHIFTS = (0.0, 1e-7, 1e-6, 1e-5, 5e-5, 1e-4, 1e-3)


def all_pairs_gradient(model, x):
    """(n, 3) of the barrier over all pairs of vertex and triangle and of edges, with areas."""
    faces = np.asfortranarray(model.mesh.triangles)
    rest = np.asfortranarray(model.mesh.points.positions(model.system.rest_positions))
    mesh = ipctk.CollisionMesh(rest, ipctk.edges(faces), faces)
    points = np.asfortranarray(model.mesh.points.positions(x))
    found = ipctk.NormalCollisions()
    found.use_area_weighting = True
    found.collision_set_type = ipctk.NormalCollisions.CollisionSetType.IMPROVED_MAX_APPROX
    found.build(mesh, points, DHAT)
    potential = ipctk.BarrierPotential(DHAT, stiffness=STIFFNESS, use_physical_barrier=True)
    out = np.zeros_like(x)
    model.mesh.points.add_forces(potential.gradient(found, mesh, points).reshape(-1, 3), out)
    return out


def own_gradient(model, x):
    """(n, 3) of Supple's barrier."""
    out = np.zeros_like(x)
    model.collisions.forget_weights()
    Barrier(model.collisions, STIFFNESS).add_gradient(x, out)
    return out


def main():
    rubber = sp.StableNeoHookean(youngs=1e5, poisson=0.3, density=1000.0)
    print("sideways force over pressing force, for shifts [m] of", *(f"{shift:.0e}" for shift in SHIFTS))
    for cells in ((1, 1), (2, 2), (3, 3), (4, 4), (8, 8), (3, 4), (2, 5)):
        meshes = [sp.shapes.box((SIDE,) * 3, (n,) * 3) for n in cells]
        bodies = [sp.Body(f"{k}", mesh, rubber, position=(0, k * (SIDE + GAP), 0)) for k, mesh in enumerate(meshes)]
        scene = sp.Scene(bodies)
        system = build_system(scene)
        settings = sp.IPCContact(dhat=DHAT, stiffness=STIFFNESS)
        model = contact_model(system, settings, np.full(len(system.tets), 1e5))
        upper = system.bodies[1].vertices
        for name, gradient in (("all pairs", all_pairs_gradient), ("supple", own_gradient)):
            shares = []
            for shift in SHIFTS:
                x = initial_state(scene).positions.copy()
                x[upper] += (shift, 0.0, 0.5 * shift)
                force = -gradient(model, x)[upper].sum(axis=0)
                shares.append(np.abs(force[[0, 2]]).max() / force[1])
            print(f"{cells[0]} on {cells[1]} cells, {name:9}", *(f"{share:.1e}" for share in shares))


if __name__ == "__main__":
    main()
