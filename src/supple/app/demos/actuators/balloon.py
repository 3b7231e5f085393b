"""A thick sphere filled with a liquid beyond the largest pressure, against the closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.app.demos.demo import Claim, Demo, Measurement
from supple.materials.elastic import NeoHookean
from supple.mesh import shapes
from supple.model.system import build_system
from supple.results.frame import Frame
from supple.scene.body import Body
from supple.scene.loads.cavity import Cavity
from supple.scene.loads.over_time import Curve
from supple.scene.scene import Scene
from supple.solvers.implicit.solver import Implicit

INNER, OUTER, EDGE = 0.1, 0.15, 0.05
YOUNGS, POISSON = 1e5, 0.49
FIRST, LAST, STEPS = 1.1, 2.0, 18


def closed_form(stretch: NDArray[np.float64]) -> NDArray[np.float64]:
    """Pressure [Pa] at stretches of the inner radius, for incompressible Neo-Hookean material.

    The integral of dW/ds / (s^3 - 1) over the hoop stretch s from the outer to the inner radius, with the density W =
    mu/2 (2 s^2 + 1/s^4 - 3) (Ogden, "Non-Linear Elastic Deformations", 1984, chapter 5).
    """
    mu = YOUNGS / (2.0 * (1.0 + POISSON))
    outer = np.cbrt(1.0 + (stretch**3 - 1.0) * (INNER / OUTER) ** 3)
    return mu * (2.0 / outer + 0.5 / outer**4 - 2.0 / stretch - 0.5 / stretch**4)


def scene() -> Scene:
    """A hollow ball whose inner radius is doubled by a liquid, in steps of equal stretch."""
    material = NeoHookean(youngs=YOUNGS, poisson=POISSON)
    ball = Body("ball", shapes.spherical_shell(INNER, OUTER, EDGE, order=2), material)
    empty = Scene([ball], cavities=[Cavity("ball", pressure=0.0)], gravity=(0, 0, 0))
    start = build_system(empty).actuators[0].start
    stretches = np.linspace(FIRST, LAST, STEPS)
    volumes = Curve(np.arange(1.0, STEPS + 1.0), start * stretches**3)
    return Scene([ball], cavities=[Cavity("ball", volume=volumes)], gravity=(0, 0, 0))


class _Measurement(Measurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        cavity = frame.report.cavities["ball"]
        return {**super().values(frame), "pressure": cavity.pressure, "volume": cavity.volume}

    def claims(self) -> list[Claim]:
        pressures = np.array(self.series["pressure"])
        start = self.first.report.cavities["ball"].volume
        stretches = np.cbrt(np.array(self.series["volume"]) / start)
        expected = closed_form(stretches)
        error = float(np.abs(pressures / expected - 1.0).max())
        top = int(pressures.argmax())
        limit = np.linspace(1.0, LAST, 2001)
        limit = float(limit[closed_form(limit).argmax()])
        off = abs(float(stretches[top]) - limit)
        return [
            Claim(
                "the pressure is that of the closed form within 1 %",
                f"largest difference {100 * error:.2g} % from a stretch of {stretches[0]:.2f} to {stretches[-1]:.2f}",
                error <= 0.01,
            ),
            Claim(
                "it is highest at the closed form's stretch, within two steps, and falls beyond",
                f"{pressures[top]:.0f} Pa at {stretches[top]:.2f} ({limit:.2f}); at last {pressures[-1]:.0f} Pa",
                off <= 2.0 * (LAST - FIRST) / (STEPS - 1) and bool(pressures[-1] < 0.98 * pressures[top]),
            ),
            self.no_tet_inverts(),
        ]


BALLOON = Demo(
    name="balloon",
    summary="a thick sphere filled beyond its largest pressure, against the closed form",
    explanation=(
        "A liquid doubles the inner radius of a hollow rubber ball. The pressure rises, and falls again beyond a "
        "stretch of about 1.6: a ball that is blown up with a given pressure would burst there. A given volume goes on."
    ),
    scene=scene,
    # Steps of a second end in the equilibrium.
    solvers={"implicit": lambda: Implicit(contact=None, tolerance=1e-6)},
    measurement=_Measurement,
    dt=1.0,
    steps=STEPS,
)
