"""How far does a beam bend? Two meshes and their extrapolated limit, compared with beam theory.

A cantilever of 1 x 0.1 x 0.1 m, E = 1 MPa, nu = 0.3, carries 0.01 N at its tip. Timoshenko's theory gives 0.4031 mm.
Linear tetrahedra are too stiff in bending. Their error is proportional to the square of the mesh size, so the limit can
be extrapolated from two meshes, here within 3 %.

Run it:  python examples/05_cantilever.py
"""

import supple as sp

LENGTH, SIDE, YOUNGS, POISSON, LOAD = 1.0, 0.1, 1e6, 0.3, 0.01


def sag(divisions: tuple[int, int, int], sinks=()) -> float:
    """Tip deflection [m] on a mesh with these numbers of cells."""
    mesh = sp.shapes.box(size=(LENGTH, SIDE, SIDE), divisions=divisions)
    x = mesh.vertices[:, 0]
    wall, tip = (x == x.min()).nonzero()[0], (x == x.max()).nonzero()[0]
    scene = sp.Scene(
        [sp.Body("beam", mesh, sp.StableNeoHookean(youngs=YOUNGS, poisson=POISSON))],
        pins=[sp.Pin("beam", wall)],
        forces=[sp.Force("beam", tip, (0, -LOAD, 0))],
        gravity=(0, 0, 0),
    )
    (frame,) = sp.simulate(scene, sp.Implicit(integrator="static"), dt=1.0, steps=1, sinks=sinks)
    return float((mesh.vertices - frame.positions["beam"])[tip, 1].mean())


def main(sinks=()) -> dict[str, float]:
    bending = LOAD * LENGTH**3 / (3 * YOUNGS * SIDE**4 / 12)
    shear_modulus, kappa = YOUNGS / (2 * (1 + POISSON)), 10 * (1 + POISSON) / (12 + 11 * POISSON)
    theory = bending + LOAD * LENGTH / (kappa * shear_modulus * SIDE**2)
    coarse, fine = sag((32, 5, 2)), sag((64, 10, 4), sinks)
    limit = fine + (fine - coarse) / 3
    for name, value in {"coarse mesh": coarse, "fine mesh": fine, "their limit": limit}.items():
        print(f"{name}: {1e3 * value:.4f} mm, {100 * value / theory:.1f} % of beam theory ({1e3 * theory:.4f} mm)")
    return {"theory": theory, "coarse": coarse, "fine": fine, "limit": limit}


if __name__ == "__main__":
    main()
