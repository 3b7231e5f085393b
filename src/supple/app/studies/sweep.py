"""`supple.sweep`: one scene with many values of its parameters, and one table of results."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from supple.app.scene_file.loader import Run
from supple.app.studies.designs import Design, Grid
from supple.app.studies.factors import Factor, as_factor
from supple.app.studies.run_case import Measure
from supple.app.studies.sources import FileSource, FunctionSource, Source
from supple.app.studies.study import CHECKPOINT_SECONDS, Study, StudyProgress, ignore_progress
from supple.app.studies.table import StudyTable
from supple.scene.scene import Scene
from supple.solvers.auto import Auto
from supple.solvers.solver import Solver


def sweep(
    source: Callable[..., Scene | Run] | str | Path,
    factors: Mapping[str, Factor | Sequence[Any]],
    *,
    measure: Measure,
    design: Design | None = None,
    folder: str | Path = "study",
    solver: Solver | Auto | None = None,
    dt: float = 1.0 / 60.0,
    steps: int = 300,
    units: Mapping[str, str] | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    retry_failed: bool = False,
    checkpoint_seconds: float = CHECKPOINT_SECONDS,
    progress: Callable[[StudyProgress], None] = ignore_progress,
) -> StudyTable:
    """Simulate every case of a study, and return the table of results, which is also in `folder/table.csv`.

    A case that has ended is not simulated again, so that an interrupted study goes on where it was. A case that fails
    is in the table with its reason. A case whose process is lost goes on in another one, from its last checkpoint.

    Parameters
    ----------
    source : a function of the factors that returns a `Scene`, or a `Run` where solver or timing vary too; or the path
        of a scene file, in which factors are dotted paths such as "bodies.bear.material.youngs".
    factors : by name, lists of values, `sp.studies.uniform(...)` or `sp.studies.loguniform(...)`.
    measure : takes a `Recording`, and returns a number, or numbers by name.
    design : `sp.studies.Grid()` (the default) or `sp.studies.LatinHypercube(...)`.
    folder : for the table, and for a folder per case. On a cluster all machines must have it under the same path.
    solver, dt, steps : for a function that returns a `Scene`; dt in [s]. Without a solver, each case has the
        one that suits it.
    units : of factors and measures, by name. Those of a scene file's values are known.
    workers : number of processes on this machine; None: one per core.
    scheduler : address of a scheduler of dask.distributed, such as "tcp://node1:8786", instead of `workers`.
    retry_failed : simulate cases again that failed in an earlier run.
    checkpoint_seconds : time from checkpoint to checkpoint of a case [s]; shorter cases have none
    progress : called whenever a case has ended.

    Raises
    ------
    StudyError, SceneError : before anything is written, where the study cannot be carried out: a factor that does not
        exist, or no case that is allowed; and where no worker can be reached.
    OutputError : where another study is writing to the folder, or it cannot be written.
    """
    chosen: Source = FunctionSource(source, solver, dt, steps) if callable(source) else FileSource(source)
    named = {name: as_factor(name, given) for name, given in factors.items()}
    study = Study(chosen, named, Grid() if design is None else design, measure, dict(units or {}))
    return study.run(
        folder,
        workers=workers,
        scheduler=scheduler,
        retry_failed=retry_failed,
        checkpoint_seconds=checkpoint_seconds,
        progress=progress,
    )
