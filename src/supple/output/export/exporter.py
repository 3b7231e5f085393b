"""Recordings in other programs' formats: one file per format, and this table of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from supple.errors import OutputError
from supple.output.drawing import opened
from supple.output.files.atomic import refuse_to_replace
from supple.output.recording.reader import Recording

Writer = Callable[[Recording, Path], None]


@dataclass(frozen=True)
class Format:
    """One format: what it is, the module and function that write it, and how its files are called."""

    about: str
    home: str
    ending: str
    is_folder: bool = False

    def writer(self) -> Writer:
        module, _, name = self.home.partition(":")
        return getattr(import_module(f"supple.output.{module}"), name)


FORMATS = {
    "glb": Format("glTF 2.0 with morph targets: Blender, three.js, game engines", "export.glb:write_glb", ".glb"),
    "obj": Format("a folder with one Wavefront OBJ for each frame", "export.obj:write_obj_folder", "_obj", True),
    "pvd": Format(
        "a folder with a ParaView collection and one VTU for each frame", "export.pvd:write_pvd", "_pvd", True
    ),
    "vtu": Format("the last frame as a VTK unstructured grid", "export.pvd:write_last_vtu", ".vtu"),
    "vtkhdf": Format(
        "a recording again, compressed; mends one whose writer was killed",
        "export.vtkhdf:write_vtkhdf",
        ".small.vtkhdf",
    ),
    "usd": Format("Universal Scene Description, with time samples (extra: usd)", "export.usd:write_usd", ".usdc"),
    "gif": Format("an animated picture (extra: video)", "export.video:write_gif", ".gif"),
    "mp4": Format("a video (extra: video)", "export.video:write_mp4", ".mp4"),
    "html": Format("a page that plays it in a browser", "page:write_page", ".html"),
}


def export(recording: Recording | str | Path, to: str, output: str | Path | None = None) -> Path:
    """Write a recording in another format; the path of what was written.

    Parameters
    ----------
    recording : an open recording, or its path.
    to : "glb", "obj", "pvd", "vtu", "vtkhdf", "usd", "gif", "mp4" or "html"; see `FORMATS`.
    output : file or folder; beside the recording, under its name, where it is not given. What is there is replaced.

    Raises
    ------
    OutputError : where the recording cannot be read, the format is unknown or needs something that is not installed, or
        the output cannot be written. Nothing half-written is left.
    """
    chosen = FORMATS.get(to.lower().lstrip("."))
    if chosen is None:
        raise OutputError(f"export: there is no format {to!r}; take one of {', '.join(FORMATS)}")
    with opened(recording) as source:
        path = Path(output) if output is not None else source.path.with_name(source.path.stem + chosen.ending)
        refuse_to_replace(source.path, path)
        chosen.writer()(source, path)
    return path
