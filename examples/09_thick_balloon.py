"""A hollow rubber ball is filled beyond its largest pressure: the pressure rises, and then falls.

A liquid doubles the inner radius of a thick sphere. A ball that is blown up with a given pressure would burst at a
stretch of about 1.6; a given volume goes on. The pressure is compared with the closed form for incompressible
Neo-Hookean material (Ogden, "Non-Linear Elastic Deformations", 1984, chapter 5).

Run it:  python examples/09_thick_balloon.py
"""

import numpy as np

import supple as sp

INNER, OUTER = 0.1, 0.15
YOUNGS, POISSON = 1e5, 0.49


def closed_form(stretch: np.ndarray) -> np.ndarray:
    """Pressure [Pa] at stretches of the inner radius.

    The integral of dW/ds / (s^3 - 1) over the hoop stretch s from the outer to the inner radius, with the energy
    W = mu/2 (2 s^2 + 1/s^4 - 3).
    """
    mu = YOUNGS / (2 * (1 + POISSON))
    outer = np.cbrt(1 + (stretch**3 - 1) * (INNER / OUTER) ** 3)
    return mu * (2 / outer + 0.5 / outer**4 - 2 / stretch - 0.5 / stretch**4)


def main(steps: int = 18, sinks=()) -> dict[str, float]:
    mesh = sp.shapes.spherical_shell(INNER, OUTER, 0.05, order=2)
    ball = sp.Body("ball", mesh, sp.NeoHookean(youngs=YOUNGS, poisson=POISSON))
    solver = sp.Implicit(contact=None, tolerance=1e-6)  # a step of a second ends in the equilibrium

    def filled(cavity: sp.Cavity, steps: int, sinks=()):
        return list(
            sp.simulate(sp.Scene([ball], cavities=[cavity], gravity=(0, 0, 0)), solver, 1.0, steps, sinks=sinks)
        )

    empty = filled(sp.Cavity("ball", pressure=0.0), 1)[0].report.cavities["ball"].volume
    stretches = np.linspace(1.1, 2.0, steps)
    volumes = sp.Curve(np.arange(1.0, steps + 1.0), empty * stretches**3)
    frames = filled(sp.Cavity("ball", volume=volumes), steps, sinks)
    pressures = np.array([frame.report.cavities["ball"].pressure for frame in frames])

    error = float(np.abs(pressures / closed_form(stretches) - 1).max())
    top = int(pressures.argmax())
    finely = np.linspace(1.0, 2.0, 2001)
    limit = float(finely[closed_form(finely).argmax()])
    print(f"at most {100 * error:.2g} % from the closed form")
    print(f"{pressures[top]:.0f} Pa at a stretch of {stretches[top]:.2f} ({limit:.2f}), {pressures[-1]:.0f} Pa at 2")
    return {
        "error": error,
        "off": abs(float(stretches[top]) - limit),
        "fall": float(pressures[-1] / pressures[top]),
        "smallest_J": min(frame.report.min_det_F for frame in frames),
    }


if __name__ == "__main__":
    main()
