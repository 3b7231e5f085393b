"""A gradient against differences of whole runs, with a verdict on which of the two is at fault.

Differences have three errors: of truncation, with the square of the step; of what is left of each step's forces and of
round-off, with the inverse of the step; and of kinks between the two runs, which no step cures. So where the first
difference does not agree, the runs are repeated with less left of forces, at steps h, h / 4 and h / 16, from which
Richardson's extrapolation and both one-sided slopes follow.

Source: Richardson, "The approximate arithmetical solution by finite differences" (1911).
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, replace
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from supple.errors import SolverError
from supple.solvers.implicit.solver import Implicit
from supple.solvers.implicit.stepping.integrators import Static, integrator_of

Floats = NDArray[np.float64]
Verdict = Literal["agree", "wrong", "noisy", "kink"]

# Relative: what gradient and differences may be apart.
_AGREE = 1e-4
# Of a loss: the share that round-off of a whole run may change.
_ROUNDED = 1e-12
# Factors of the solver's tolerance, the second one where runs do not converge with the first.
_SHARPER = (1e-4, 1e-2)
_RATIO, _SIZES = 4.0, 3
# Of what gradient and differences are apart: differences that change by less from step to step have settled.
_SETTLED = 0.25
# A jump of the slope stays in steps 16 times as small, where that of a smooth loss falls by 16 and that of noise grows.
_STAYS = (0.15, 2.0)


class Runs(Protocol):
    """What is checked: a `Sensitivity`."""

    solver: Implicit

    def value_and_gradient(self, p: Floats) -> tuple[float, Floats]: ...
    def value_and_structure(self, p: Floats) -> tuple[float, list[dict[str, float]]]: ...


@dataclass(frozen=True, eq=False)
class Check:
    """Derivatives along directions: of the gradient, and of central differences of whole runs.

    Attributes
    ----------
    directions : (d, q); gradient, differences : (d,) in the unit of the loss; noise : what round-off makes of these
    verdict : "agree"; "wrong", of the gradient; "noisy" or "kink", of the differences
    reason : what was found, and the remedy
    relative : their largest difference, over the largest of them; ok : whether they agree
    """

    directions: Floats
    gradient: Floats
    differences: Floats
    noise: float
    verdict: Verdict
    reason: str

    @property
    def relative(self) -> float:
        largest = max(float(np.abs(self.differences).max(initial=0.0)), self.noise)
        return float(np.abs(self.gradient - self.differences).max(initial=0.0)) / largest if largest else 0.0

    @property
    def ok(self) -> bool:
        return self.verdict == "agree"

    def __str__(self) -> str:
        rows = zip(self.gradient, self.differences, strict=True)
        lines = [f"direction {k + 1}: gradient {a:.9g}, differences {b:.9g}" for k, (a, b) in enumerate(rows)]
        return "\n".join([*lines, f"{self.reason}: relative difference {self.relative:.2g}"])


@dataclass(frozen=True, eq=False)
class _Pair:
    """Runs on both sides: the difference, the jump of the slope, and what the runs differ in, frame by frame."""

    slope: float
    jump: float
    differ: str

    @classmethod
    def of(cls, one: Runs, p: Floats, way: Floats, h: float, middle: float) -> _Pair:
        (above, over), (below, under) = (one.value_and_structure(p + sign * h * way) for sign in (1.0, -1.0))
        differ = [
            f"frame {k + 1} has {a[name]:.6g} {name} in one of the two runs, and {b[name]:.6g} in the other"
            for k, (a, b) in enumerate(zip(over, under, strict=True))
            for name in a
            if a[name] != b[name]
        ]
        return cls((above - below) / (2.0 * h), (above - 2.0 * middle + below) / h, next(iter(differ), ""))


def check(one: Runs, p: Floats, ways: Floats, h: float) -> Check:
    """Compare the gradient at p (q,) with differences along `ways` (d, q) by steps of h."""
    value, gradient = one.value_and_gradient(p)
    rough = [_Pair.of(one, p, way, h, value) for way in ways]
    found = Check(
        ways, ways @ gradient, np.array([pair.slope for pair in rough]), _ROUNDED * abs(value) / h, "agree", ""
    )
    if found.relative <= _AGREE:
        return replace(found, reason="gradient and differences agree")
    fine, value, gradient = _sharpened(one, p)
    pairs = [[_Pair.of(fine, p, way, h / _RATIO**k, value) for k in range(_SIZES)] for way in ways]
    slopes = np.array([[pair.slope for pair in some] for some in pairs])
    extrapolated = slopes[:, 1:] + (slopes[:, 1:] - slopes[:, :-1]) / (_RATIO**2 - 1.0)
    along = ways @ gradient
    scale = max(float(np.abs(slopes).max()), found.noise)
    # The finest difference has no part in what begins to act within the coarser ones.
    off = np.abs(np.stack([extrapolated[:, -1], slopes[:, -1]]) - along)
    best = np.where(off[0] <= off[1], extrapolated[:, -1], slopes[:, -1])
    noise, off = found.noise * _RATIO ** (_SIZES - 1), off.min(axis=0)
    found = replace(found, gradient=along, differences=best, noise=noise)
    given, sharp = (
        "the default tolerance" if of.solver.tolerance is None else f"tolerance={of.solver.tolerance:.2g}"
        for of in (one, fine)
    )
    if (off <= _AGREE * scale).all():
        if np.abs(slopes[:, 0] - [pair.slope for pair in rough]).max() <= _AGREE * scale:
            return replace(found, reason="gradient and differences agree, as far as steps are small enough")
        text = f"differences are too noisy with {given}; use {sharp}, with which they agree"
        return replace(found, verdict="noisy", reason=text)
    worst = int(off.argmax())
    settled = abs(extrapolated[worst, -1] - extrapolated[worst, -2]) <= _SETTLED * off[worst]
    jumps, differ = [abs(pair.jump) for pair in pairs[worst]], pairs[worst][-1].differ
    stays = jumps[-1] > _AGREE * scale and _STAYS[0] <= jumps[-1] / max(jumps[0], _AGREE * scale) <= _STAYS[1]
    if stays or (differ and not settled):
        where = differ or "the slope of the loss jumps there"
        text = f"there is a kink or jump between the two runs: {where}; check at other parameters, or with another step"
        return replace(found, verdict="kink", reason=text)
    if not settled:
        text = f"differences are too noisy, even with {sharp}; use a larger step, or fewer steps of the run"
        return replace(found, verdict="noisy", reason=text)
    return replace(found, verdict="wrong", reason="the gradient is wrong, as differences settle on other values")


def _sharpened(one: Runs, p: Floats) -> tuple[Runs, float, Floats]:
    """With a sharper tolerance as far as runs converge; its loss and gradient (q,)."""
    solver = one.solver
    given = solver.tolerance or (1e-9 if isinstance(integrator_of(solver.integrator), Static) else 1e-3)
    fine = copy.copy(one)
    for factor in _SHARPER:
        forces = min(solver.force_tolerance, max(factor * solver.force_tolerance, 1e-9))
        fine.solver = replace(solver, tolerance=max(factor * given, min(given, 1e-13)), force_tolerance=forces)
        try:
            return fine, *fine.value_and_gradient(p)
        except SolverError:
            continue
    return one, *one.value_and_gradient(p)
