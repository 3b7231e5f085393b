"""Pages as the output of a notebook's cell."""

from __future__ import annotations

import html
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from supple.errors import OutputError
from supple.materials.elastic import StableNeoHookean
from supple.mesh import shapes
from supple.mesh.surface import SurfaceMesh
from supple.mesh.tetmesh import TetMesh
from supple.model.system import build_system, initial_state
from supple.results.frame import Frame, start_frame
from supple.results.page.page import write_page
from supple.results.recording.frame import RecordedFrame
from supple.results.recording.reader import Recording
from supple.results.recording.recorder import Recorder
from supple.runtime.replacing import whole_file
from supple.scene.body import Body
from supple.scene.scene import Scene

_LEAST, _MOST = 100, 4000  # heights [pixels]


@dataclass(frozen=True, eq=False, repr=False)
class Player:
    """A page that a notebook shows as the output of a cell.

    Attributes
    ----------
    page : the HTML, complete in itself
    title : what it shows
    height : of the picture [pixels]
    """

    page: str
    title: str
    height: int

    def __repr__(self) -> str:
        return f"Player of {self.title}: the last line of a notebook's cell shows it; save('page.html') writes it"

    def _repr_html_(self) -> str:
        """An inner page, which shares no names or styles with the notebook."""
        return (
            f'<iframe srcdoc="{html.escape(self.page)}" title="{html.escape(self.title)}" '
            f'style="width:100%;height:{self.height}px;border:0" allowfullscreen></iframe>'
        )

    def save(self, path: str | Path) -> Path:
        """Write the page to a file, which any browser opens.

        Raises
        ------
        OutputError : where it cannot be written.
        """
        path = Path(path)
        with whole_file(path) as fresh:
            fresh.write_text(self.page, encoding="utf-8")
        return path


def player_of(shown: Any, height: int) -> Player:
    """A player of a recording, or of one frame, of a scene at its start, or of a mesh.

    Raises
    ------
    OutputError : where the height is out of range, or the object cannot be drawn.
    """
    if isinstance(height, bool) or not isinstance(height, int) or not _LEAST <= height <= _MOST:
        raise OutputError(f"show: height is {height!r}; give whole pixels from {_LEAST} to {_MOST}")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = Path(name)
        return Player(_page(shown, folder), _title(shown), height)


def _page(shown: Any, folder: Path) -> str:
    page = folder / "page.html"
    if isinstance(shown, Recording):
        write_page(shown, page)
    elif isinstance(shown, RecordedFrame):
        write_page(shown.recording.path, page, frames=[shown])
    else:
        scene = _scene_of(shown) if isinstance(shown, TetMesh | SurfaceMesh) else shown
        frame = scene if isinstance(scene, Frame) else _first_frame(scene)
        recorder = Recorder(folder / "frame.vtkhdf")
        try:
            recorder.begin(frame, 1.0, 0)
        finally:
            recorder.end()
        write_page(recorder.path, page)
    return page.read_text(encoding="utf-8")


def _scene_of(mesh: TetMesh | SurfaceMesh) -> Scene:
    """A scene with a mesh alone; of a surface, whether it is closed or not, as the skin of the box around it."""
    material = StableNeoHookean(youngs=1.0, poisson=0.3)
    if isinstance(mesh, TetMesh):
        return Scene([Body("mesh", mesh, material)], gravity=(0, 0, 0))
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    size = np.maximum(high - low, 1e-3 * float(np.max(high - low)))
    box = shapes.box(tuple(1.01 * size), (1, 1, 1))
    around = TetMesh(box.vertices + 0.5 * (low + high), box.tets)
    return Scene([Body("mesh", around, material, skin=mesh)], gravity=(0, 0, 0))


def _first_frame(scene: Scene) -> Frame:
    state = initial_state(scene)
    return start_frame(build_system(scene, state), state, 0, None)


def _title(shown: Any) -> str:
    if isinstance(shown, Recording):
        return f"{len(shown)} frames of {shown.path.name}"
    if isinstance(shown, Scene):
        return f"the start of {len(shown.bodies)} bodies"
    if isinstance(shown, TetMesh | SurfaceMesh):
        return f"a {type(shown).__name__}"
    return f"frame {shown.index}"
