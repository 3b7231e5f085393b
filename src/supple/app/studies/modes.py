"""Natural modes of a scene: frequencies, shapes, and a film of one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from supple.errors import SceneError, SolverError
from supple.model.state import State, Status, StepReport
from supple.model.system import initial_state
from supple.results.frame import Frame, completed_report
from supple.results.recording.recorder import Recorder
from supple.scene.rigid.pose import nearest_rigid
from supple.scene.scene import Scene
from supple.simulate import StartFrame, first_frame
from supple.solvers.implicit.natural_modes import natural_modes

# One period of a film takes a second, in 30 pictures.
_PICTURES = 30


@dataclass(frozen=True, eq=False)
class Modes:
    """The lowest natural modes of a scene about a state.

    Attributes
    ----------
    frequencies : (k,) in ascending order [Hz]. Rigid motions of what nothing holds have zero up to round-off. A
        negative one, -f, belongs to a motion that grows as exp(2 pi f t): the state is not stable.
    frame : the state
    """

    frequencies: NDArray[np.float64]
    frame: Frame
    vectors: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.frequencies)

    def __repr__(self) -> str:
        return f"Modes({', '.join(f'{f:.6g}' for f in self.frequencies)} Hz)"

    def shape(self, mode: int) -> Mapping[str, NDArray[np.float64]]:
        """The displacements of a mode, by body: (n, 3) as in `Frame.positions`, the longest of all bodies is 1 [-].

        Parameters
        ----------
        mode : its number, from 0.

        Raises
        ------
        SolverError : where the mode does not exist.
        """
        return self.frame.system.split(self._vector(mode) / self._longest(mode))

    def save(self, path: str | Path, mode: int, amplitude: float | None = None) -> None:
        """Write a recording of one period of a mode, stretched to a second, for page, film and ParaView.

        Parameters
        ----------
        path : of the recording, see `Recorder`. A name without a suffix is that of a folder for `recording.vtkhdf`.
        mode : its number, from 0.
        amplitude : the longest displacement [m]; None for a tenth of the scene's diagonal.

        Raises
        ------
        SolverError : where the mode does not exist, or the amplitude is not above zero.
        OutputError : where the file cannot be written.
        """
        path, frame = Path(path), self.frame
        x = np.concatenate(list(frame.positions.values()))
        longest = self._longest(mode)
        if amplitude is None:
            amplitude = 0.1 * float(np.linalg.norm(np.ptp(x, axis=0)))
        if not (np.isfinite(amplitude) and amplitude > 0.0):
            raise SolverError(f"modes: the amplitude is {amplitude!r}; it must be finite and above zero [m]")
        recorder = Recorder(path if path.suffix else path / "recording.vtkhdf")
        recorder.begin(self._at(mode, 0, 0.0), 1.0 / _PICTURES, _PICTURES)
        try:
            for k in range(1, _PICTURES + 1):
                recorder.write(self._at(mode, k, amplitude / longest * np.sin(2.0 * np.pi * k / _PICTURES)))
        finally:
            recorder.end()

    def _vector(self, mode: int) -> NDArray[np.float64]:
        """(n, 3) the displacements of a mode."""
        if isinstance(mode, bool) or not isinstance(mode, int | np.integer) or not 0 <= mode < len(self):
            raise SolverError(f"modes: mode {mode!r} does not exist; there are modes 0 to {len(self) - 1}")
        return self.vectors[mode]

    def _longest(self, mode: int) -> float:
        """The longest displacement in the vector of a mode."""
        points = self.frame.system.split(self._vector(mode)).values()
        return max(float(np.linalg.norm(part, axis=1).max()) for part in points)

    def _at(self, mode: int, index: int, factor: float) -> Frame:
        """A frame of the film, with rigid bodies rigid."""
        frame, system = self.frame, self.frame.system
        x = frame.state.positions + factor * self._vector(mode)
        for part in system.rigid_bodies:
            x[part.vertices] = nearest_rigid(system.rest_positions[part.vertices], x[part.vertices])
        system.welding.follow(x)
        time = frame.time + index / _PICTURES
        state = replace(frame.state, time=time, positions=x, velocities=np.zeros_like(x), memory=None)
        report = completed_report(system, state, StepReport(Status.CONVERGED, 0), 0.0)
        return Frame(index, state, system, report)


def modes(scene: Scene, count: int = 6, *, start: StartFrame | State | None = None) -> Modes:
    """The lowest natural frequencies of a scene and their shapes: small vibrations without damping.

    Stiffness and mass are those of `Implicit`: pins, joints and welds hold, stitches, springs, cavities and cables are
    stiff, loads stiffen and soften through the stresses that they make, masses are lumped. Contact is not part of it.

    Parameters
    ----------
    scene : what vibrates.
    count : how many modes.
    start : the state to vibrate about: a frame, also of a recording, or a state; None for the scene's start. Without
        loads that is an equilibrium; with them, give the frame of `Implicit(integrator="static")`.

    Returns
    -------
    Modes : with `frequencies` [Hz], `shape(mode)`, and `save(path, mode)`.

    Raises
    ------
    SceneError : where the scene or the start is of the wrong kind.
    SolverError : where everything is held, there are fewer modes, they were not found, or a material is one of XPBD.

    Source: Bathe, "Finite Element Procedures" (2014), chapters 10 and 11.
    """
    if not isinstance(scene, Scene):
        raise SceneError(f"modes: the scene is a {type(scene).__name__}; give a Scene")
    if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 1:
        raise SolverError(f"modes: count is {count!r}; give a whole number above zero")
    frame = first_frame(scene, initial_state(scene) if start is None else start)
    frequencies, vectors = natural_modes(frame.system, frame.state, int(count))
    return Modes(frequencies, frame, vectors)
