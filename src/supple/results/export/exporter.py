"""Recordings in the formats of other programs: one module for each format, and the table of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from supple.errors import OutputError
from supple.results.export.video import Film
from supple.results.recording.reader import Recording, opened
from supple.results.recording.recorder import SUFFIXES as RECORDING_SUFFIXES
from supple.runtime.replacing import refuse_to_replace

Writer = Callable[..., None]


@dataclass(frozen=True)
class Format:
    """One format.

    Attributes
    ----------
    home : the module in this package, and its function that writes the format: `write(recording, path)`, or with a
        `Film` as the third; or the function itself
    suffixes : that a file of this format may have; none where the format is a folder
    film : of a format that is drawn, what differs from the defaults of `Film`; None of the others
    """

    home: str | Writer
    suffixes: tuple[str, ...] = ()
    film: Mapping[str, Any] | None = None

    def writer(self) -> Writer:
        if not isinstance(self.home, str):
            return self.home
        module, _, name = self.home.partition(":")
        return getattr(import_module(f"supple.results.{module}"), name)


FORMATS = {
    "glb": Format("export.glb:write_glb", (".glb",)),  # glTF 2.0 with morph targets
    "obj": Format("export.obj:write_obj_folder"),  # one Wavefront OBJ for each frame
    "vtu": Format("export.vtu:write_last_vtu", (".vtu",)),  # the last frame as a VTK unstructured grid
    "vtkhdf": Format("export.vtkhdf:write_vtkhdf", RECORDING_SUFFIXES),  # a recording again, compressed and repaired
    "usd": Format("export.usd:write_usd", (".usdc", ".usda", ".usd")),  # with time samples (extra: usd)
    "gif": Format(
        "export.video:write_video", (".gif",), {"size": (640, 360), "rate": 20.0}
    ),  # (extra: video, or render)
    "mp4": Format("export.video:write_video", (".mp4",), {}),  # (extra: video, or render)
    "png": Format("export.video:write_video", (".png",), {}),  # one instant (extra: video, or render)
    "csv": Format("export.table:write_csv", (".csv",)),  # the reports of all frames
    "html": Format("page.page:write_page", (".html", ".htm")),  # plays the recording in a browser
}


def export(recording: Recording | str | Path, to: str, output: str | Path | None = None, **film: Any) -> Path:
    """Write a recording in another format; the path of what was written.

    Parameters
    ----------
    recording : an open recording, or its path.
    to : "glb", "obj", "vtu", "vtkhdf", "usd", "gif", "mp4", "png", "csv" or "html"; see `FORMATS`.
    output : file, with a suffix of the format, or folder; beside the recording, under its name, where it is not given.
        What is there is replaced.
    film : how a film or picture is drawn, such as `size=(1920, 1080)` or `camera="follow"`: the parameters of `Film`.

    Raises
    ------
    OutputError : where the recording cannot be read, the format is unknown, needs something that is not installed or
        does not agree with the output's suffix, or the output cannot be written. No incomplete file is left.
    """
    name = to.lower().lstrip(".")
    if name not in FORMATS:
        raise OutputError(f"export: format {to!r} does not exist; take one of {', '.join(FORMATS)}")
    if output is not None:
        _require_suffix(name, Path(output))
    chosen = FORMATS[name]
    if film and chosen.film is None:
        drawn = ", ".join(key for key, one in FORMATS.items() if one.film is not None)
        raise OutputError(f"export: {', '.join(film)}: only {drawn} are drawn; leave that out for {name}")
    unknown = film.keys() - Film.__dataclass_fields__.keys()
    if unknown:
        raise OutputError(f"export: {min(unknown)} does not exist; there are {', '.join(Film.__dataclass_fields__)}")
    look = () if chosen.film is None else (Film(**{**chosen.film, **film}),)
    with opened(recording) as source:
        path = Path(output) if output is not None else source.path.with_name(source.path.stem + _ending(name))
        refuse_to_replace(source.path, path)
        chosen.writer()(source, path, *look)
    return path


def _ending(name: str) -> str:
    """What follows the stem of the recording in the name of the output."""
    if not FORMATS[name].suffixes:
        return f"_{name}"
    return (".small" if name == "vtkhdf" else "") + FORMATS[name].suffixes[0]


def _require_suffix(name: str, output: Path) -> None:
    """Raise `OutputError` where the name of the output belongs to another format."""
    chosen, suffix = FORMATS[name], output.suffix.lower()
    if chosen.suffixes and suffix not in chosen.suffixes:
        raise OutputError(
            f"{output}: a file in format {name} must end in {' or '.join(chosen.suffixes)}; name it "
            f"{output.stem}{chosen.suffixes[0]}, or choose another format"
        )
    known = {f".{name}", *(ending for other in FORMATS.values() for ending in other.suffixes)}
    if not chosen.suffixes and suffix in known:
        raise OutputError(
            f"{output}: format {name} is a folder of files; name it {output.stem}, or choose another format"
        )
