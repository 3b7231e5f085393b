"""A rubber balloon is filled beyond its largest pressure, beside the closed form of a membrane."""

from __future__ import annotations

from typing import Any

import numpy as np

from supple.app.demos.demo import Claim, Demo, Measurement
from supple.materials.shells.shell_material import ShellMaterial
from supple.mesh import shapes
from supple.results.frame import Frame
from supple.scene.loads.cavity import Cavity
from supple.scene.loads.over_time import Curve
from supple.scene.scene import Scene
from supple.scene.shell import Shell
from supple.solvers.implicit.solver import Implicit

RADIUS, THICKNESS, YOUNGS, LARGEST, END = 0.1, 1e-3, 1e6, 2.5, 1.5
SURFACE = shapes.sphere_surface(RADIUS, 0.03)
# Triangles of a sphere enclose less than it: the closed form is of the sphere with their volume.
ROUND = float(SURFACE.volume / (4.0 / 3.0 * np.pi)) ** (1.0 / 3.0)


def closed_form(stretch: float) -> float:
    """Pressure [Pa] in a thin ball of incompressible neo-Hookean rubber whose radius has grown by `stretch`.

    2 mu t / R (1/s - 1/s^7); Ogden, "Non-Linear Elastic Deformations" (1984), section 5.3.
    """
    return 2.0 * YOUNGS / 3.0 * THICKNESS / ROUND * (1.0 / stretch - stretch**-7)


def scene() -> Scene:
    """A ball of 20 cm with a skin of 1 mm, into which a liquid flows."""
    rubber = ShellMaterial(youngs=YOUNGS, poisson=0.5, thickness=THICKNESS, density=1000.0)
    times = np.linspace(0.0, END, 91)
    volumes = SURFACE.volume * np.linspace(1.0, LARGEST, 91) ** 3
    filled = Cavity("balloon", volume=Curve(times, volumes))
    return Scene([Shell("balloon", SURFACE, rubber)], cavities=[filled], gravity=(0, 0, 0))


class _Measurement(Measurement):
    def values(self, frame: Frame) -> dict[str, Any]:
        cavity, x = frame.report.cavities["balloon"], frame.positions["balloon"]
        radii = np.linalg.norm(x - x.mean(axis=0), axis=1)
        stretch = (cavity.volume / SURFACE.volume) ** (1.0 / 3.0)
        return {"stretch": stretch, "pressure": cavity.pressure, "round": float(np.ptp(radii) / radii.mean())}

    def claims(self) -> list[Claim]:
        stretches, pressures = np.array(self.series["stretch"]), np.array(self.series["pressure"])
        error = np.abs(pressures / closed_form(stretches) - 1.0)  # pyright: ignore[reportArgumentType]
        worst = float(error[stretches > 1.05].max(initial=0.0))
        top, limit = int(pressures.argmax()), 7.0 ** (1.0 / 6.0)
        off, uneven = abs(float(stretches[top]) - limit), max(self.series["round"])
        return [
            Claim(
                f"its radius grows to {LARGEST} times that at rest",
                f"{stretches[-1]:.4f} times",
                abs(float(stretches[-1]) - LARGEST) < 1e-3,
            ),
            Claim(
                "from a stretch of 1.05 on, the pressure is that of the closed form within 1 %",
                f"at most {100 * worst:.2g} % off",
                worst < 0.01,
            ),
            Claim(
                "the largest pressure is at a stretch of 7^(1/6) = 1.383, within 0.03; then it falls",
                f"{pressures[top]:.0f} Pa at {stretches[top]:.3f}, {pressures[-1]:.0f} Pa at the end",
                off < 0.03 and float(pressures[-1]) < 0.8 * float(pressures[top]),
            ),
            Claim("it stays round within 1 %", f"radii differ by {100 * uneven:.2g} % at most", uneven < 0.01),
        ]


BALLOON = Demo(
    name="balloon",
    summary="a rubber balloon is filled beyond its largest pressure, beside the closed form",
    explanation=(
        "A liquid fills a balloon, a shell of 1 mm of incompressible rubber, to 2.5 times its radius. The pressure "
        "rises to a stretch of 1.38 and falls then: with a given pressure it would burst, a given volume goes on. "
        "Each frame is compared with the closed form of a neo-Hookean membrane."
    ),
    scene=scene,
    # What Newton's method leaves undone turns a body that floats: so it is within the limit of `supple check`.
    solvers={"implicit": lambda: Implicit(contact=None, tolerance=1e-7)},
    measurement=_Measurement,
    steps=90,
)
