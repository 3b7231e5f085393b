"""Run the examples that find parameters, and draw each before and after in docs/images/inverse.

`python docs/draw_inverse_problems.py` draws all, `python docs/draw_inverse_problems.py throw` some. It needs the extra
`video` and, on Debian, libegl1.
"""

from __future__ import annotations

import runpy
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import scipy.optimize

import supple as sp
from supple.results.export.video import Film
from supple.results.export.video_worker import Studio
from supple.results.view.from_recording import model_of_recording, render_frame_of
from supple.runtime.figures import paper_figure

FOLDER = Path(__file__).parent
PICTURES = FOLDER / "images" / "inverse"
SIZE = (480, 320)  # of a picture


def foam(module: dict[str, Any], frames: list[sp.Frame], _: Any) -> list[Any]:
    displacement, force = np.loadtxt(module["DATA"], delimiter=",", skiprows=1, unpack=True)
    simulated = [-list(frame.reactions.values())[-1][1] for frame in frames]
    return [1e3 * displacement, force, 1e3 * displacement, simulated, "displacement [mm]", "force [N]"]


def film(module: dict[str, Any], frames: list[sp.Frame], sensitivity: Any) -> list[Any]:
    (misfit,) = sensitivity.loss.misfits
    times = [1e3 * frame.time for frame in frames]
    tip = [1e3 * frame.positions["part"][module["MARKERS"][-1], 1] for frame in frames]
    return [times, 1e3 * misfit.target[:, -1, 1], times, tip, "time [ms]", "height of the last marker [mm]"]


def finger(module: dict[str, Any], frames: list[sp.Frame], _: Any) -> list[Any]:
    times = [frame.time for frame in frames]
    y = module["MESH"].vertices[module["TIP"], 1]
    tip = [1e3 * float((frame.positions["finger"][module["TIP"], 1] - y)[0]) for frame in frames]
    return [times, 1e3 * module["PATH"], times, tip, "time [-]", "height of the tip [mm]"]


def throw(module: dict[str, Any], frames: list[sp.Frame], _: Any) -> list[Any]:
    way = np.array([frame.positions["ball"].mean(axis=0) for frame in frames])
    return [[module["BOWL"][0]], [0.08], way[:, 0], way[:, 1], "x of the center [m]", "height of the center [m]"]


def sag(module: dict[str, Any], frames: list[sp.Frame], _: Any) -> list[Any]:
    wanted = module["WANTED"].vertices
    line = np.flatnonzero((np.abs(wanted[:, 1]) < 1e-9) & (np.abs(wanted[:, 2]) < 1e-9))
    there = 1e3 * frames[-1].positions["arm"][line]
    return [1e3 * wanted[line, 0], 1e3 * wanted[line, 1], there[:, 0], there[:, 1], "x [mm]", "height of the axis [mm]"]


# By name of the picture: the example, the function that makes its scene, which frame is shown, its curve, which has
# points and what is simulated, and what the points are.
EXAMPLES: dict[str, tuple[str, str, float, Callable[..., list[Any]], str]] = {
    "foam_law": ("16_foam_law", "test_of", 1.0, foam, "measured"),
    "stiffness_from_film": ("17_stiffness_from_film", "swing", 1.0, film, "measured"),
    "pneumatic_finger": ("18_pneumatic_finger", "finger", 0.5, finger, "wanted"),
    "throw": ("19_throw", "throw", 0.0, throw, "wanted"),
    "inverse_sag": ("20_inverse_sag", "arm", 1.0, sag, "wanted"),
}


def fitted(file: str, scene: str) -> tuple[dict[str, Any], Any, np.ndarray, np.ndarray]:
    """Run an example: what it defines, its sensitivity, where its parameters start, and what it finds."""
    seen: list[tuple[np.ndarray, np.ndarray]] = []
    made: list[sp.Sensitivity] = []

    class Noted(sp.Sensitivity):
        def __init__(self, *args: Any, **given: Any) -> None:
            super().__init__(*args, **given)
            made.append(self)

    def noting(search: Callable[..., Any], first: int, key: str) -> Callable[..., Any]:
        def found(*args: Any, **given: Any) -> Any:
            result = search(*args, **given)
            seen.append((np.asarray(args[first], float), getattr(result, key)))
            return result

        return found

    before = sp.fit_simulation, scipy.optimize.minimize, sp.Sensitivity
    try:
        sp.fit_simulation = noting(sp.fit_simulation, 1, "values")
        scipy.optimize.minimize = noting(scipy.optimize.minimize, 1, "x")
        sp.Sensitivity = Noted
        module = runpy.run_path(str(FOLDER.parent / "examples" / f"{file}.py"))
        module["main"]()
    finally:
        sp.fit_simulation, scipy.optimize.minimize, sp.Sensitivity = before
    assert scene in module
    return module, made[0], *seen[-1]


def draw(name: str, folder: Path) -> None:
    """Run an example and save its picture."""
    file, scene, share, curve, points = EXAMPLES[name]
    module, sensitivity, start, found = fitted(file, scene)
    runs, shown, model = [], [], None
    for k, p in enumerate((start, found)):
        path = folder / f"{name}{k}.vtkhdf"
        times = sensitivity.dt, sensitivity.steps
        made = sp.simulate(module[scene](p), sensitivity.solver, *times, sinks=[sp.Recorder(path)])
        runs.append(list(made))
        with sp.read_recording(path) as recording:
            model = model or model_of_recording(recording)
            shown.append(render_frame_of(model, recording[round(share * (len(recording) - 1))]))
    assert model is not None
    studio = Studio(model, shown, Film(size=SIZE))
    PICTURES.mkdir(exist_ok=True)
    rows = 2 if share else 1  # a ball that is small beside its flight is drawn by its path alone
    with paper_figure(PICTURES / f"{name}.png", 7.2, 2.4 * rows) as figure:
        axes = figure.subplots(rows, 2, squeeze=False, gridspec_kw={"height_ratios": [3, 2][-rows:]})
        for k, title in enumerate(("before", "after")):
            axes[0, k].set_title(title)
            if share:
                axes[0, k].imshow(studio.picture(shown[k], 0.0))
                axes[0, k].axis("off")
            else:
                bowl = np.array([0.6, 0.0, 0.6])
                axes[0, k].plot(module["BOWL"][0] + [-0.6, 0.0, 0.6], module["SLOPE"] * bowl, "-", color="0.5")
            x, wanted, at, simulated, across, up = curve(module, runs[k], sensitivity)
            axes[-1, k].plot(x, wanted, "o", markersize=4, color="#30638e", label=points)
            axes[-1, k].plot(at, simulated, "-", color="#d1495b", label="simulated")
            axes[-1, k].set_xlabel(across)
        axes[-1, 0].set_ylabel(up)
        axes[-1, 1].legend()
        axes[-1, 1].sharey(axes[-1, 0])
    print(name, flush=True)


def main(names: list[str]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        for name in names or EXAMPLES:
            draw(name, Path(folder))


if __name__ == "__main__":
    main(sys.argv[1:])
