"""What `supple info` prints of a run folder."""

from __future__ import annotations

from pathlib import Path

from supple.app.runs.contents import RunPaths
from supple.app.runs.journal import Journal, Session, differences, read_journal, versions
from supple.errors import OutputError
from supple.runtime.lock import is_locked


def run_rows(folder: Path) -> list[tuple[str, str]]:
    """Names and values: the run, each process that worked on it, and how to resume.

    Raises
    ------
    OutputError : where the folder contains no run.
    """
    paths = RunPaths(folder)
    journal = read_journal(paths.journal)
    run = journal.run
    running = is_locked(folder)
    kept = [str(int(path.stem)) for path in reversed(paths.checkpoints())]
    every = [f"{n} frames" for n in [journal.checkpoint_every] if n] + [
        f"{s:g} s" for s in [journal.checkpoint_seconds] if s
    ]
    rows = [
        ("kind", "run folder"),
        ("scene", _scene(journal)),
        ("solver", ", chosen: ".join(filter(None, [run.solver, journal.origin.get("solver_chosen")]))),
        ("time", f"{run.steps} steps of {run.dt:.6g} s: {run.steps * run.dt:.6g} s"),
        ("seed", "none was given" if journal.seed is None else str(journal.seed)),
        ("recording", _recording(paths)),
        ("checkpoints", f"frames {', '.join(kept)}" + ("" if not every else f"; every {' or '.join(every)}")),
    ]
    last = journal.sessions[-1]
    for number, session in enumerate(journal.sessions, start=1):
        rows.append((f"session {number}", _session(session, running and session is last)))
    machine = last.machine
    rows.append(
        ("machine", ", ".join(f"{machine[key]}" for key in ("name", "platform", "processor") if key in machine))
    )
    rows.append(("threads", f"{machine.get('threads')} of {machine.get('processors')} processors"))
    rows.append(("versions", ", ".join(f"{name} {version}" for name, version in last.versions.items())))
    changed = differences(last.versions, versions())
    if changed:
        rows.append(("changed since", changed))
    rows.append(("next", _next(folder, last, running)))
    return rows


def _scene(journal: Journal) -> str:
    origin = journal.origin
    match origin.get("kind"):
        case "scene_file":
            moved = ", with bodies moved apart" if origin.get("separate") else ""
            return f"{origin.get('file')}{moved}; as resolved: run/scene.yaml"
        case "demo":
            return f"demo {origin.get('name')}"
    return "made by a program"


def _recording(paths: RunPaths) -> str:
    from supple.results.recording.reader import read_recording

    try:
        with read_recording(paths.recording) as recording:
            frames = f"frames {recording[0].index} to {recording[-1].index}, t = {recording.times[-1]:.6g} s"
            return f"{frames}; {paths.recording.stat().st_size / 2**20:.1f} MiB"
    except OutputError as error:
        return str(error)


def _session(session: Session, is_running: bool) -> str:
    how = session.outcome + (f" ({session.message})" if session.message else "")
    if session.outcome == "running":
        how = "running" if is_running else "killed"
    frames = f"from frame {session.first_frame}" + ("" if session.ended is None else f" to {session.last_frame}")
    until = "" if session.ended is None else f" to {session.ended}"
    return f"{how}; {frames}; {session.begun}{until}; {' '.join(session.command)}"


def _next(folder: Path, last: Session, is_running: bool) -> str:
    if is_running:
        return "it is running"
    if last.outcome == "finished":
        return f"complete; more frames: supple resume {folder} --steps N"
    return f"supple resume {folder}"
