"""What is shown of an object: one line of text, a table in notebooks, and a picture that `show` draws.

The lowest layer describes; `supple.results.page.player` draws, and `supple/__init__.py` names it here.
"""

from __future__ import annotations

import html
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

# By what they do, functions of upper layers that methods of lower ones call: "module:name".
_FROM_ABOVE: dict[str, str] = {}
# Called as kernels are loaded and compiled with "loaded", "compiling" or "compiled", their name and their signature.
WATCHERS: list[Callable[[str, str, Any], None]] = []


def supply(**homes: str) -> None:
    """Name functions of upper layers, as "module:name"."""
    _FROM_ABOVE.update(homes)


def supplied(what: str) -> Callable[..., Any]:
    """A function that an upper layer supplies."""
    module, _, name = _FROM_ABOVE[what].partition(":")
    return getattr(import_module(module), name)


class Displayed(ABC):
    """An object with a short text, and a table in notebooks."""

    @abstractmethod
    def _facts(self) -> Mapping[str, str]:
        """What is shown, by name; cheap to compute."""

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{name}: {value}' for name, value in self._facts().items())})"

    def _repr_html_(self) -> str:
        style = ' style="text-align:left"'
        rows = "".join(
            f"<tr><th{style}>{html.escape(name)}</th><td{style}>{html.escape(value)}</td></tr>"
            for name, value in self._facts().items()
        )
        return f"<table><caption>{type(self).__name__}</caption>{rows}</table>"


class Showable(Displayed):
    """An object that a notebook can draw."""

    def show(self, *, height: int = 480) -> Any:
        """A player for notebooks: bodies and obstacles in 3D, which the mouse turns; a recording plays.

        It needs no server and no widgets: the page, about 0.7 MB and the frames, is part of the notebook's output. In a
        script, `show().save("page.html")` writes the page.

        Parameters
        ----------
        height : of the picture [pixels].

        Raises
        ------
        OutputError : where the object cannot be drawn.
        """
        return supplied("player")(self, height)


class DisplayedFrame(Showable):
    """A frame: of a simulation, or of a recording."""

    def _facts(self) -> Mapping[str, str]:
        this: Any = self
        report = this.report
        return {
            "index": str(this.index),
            "time": f"{this.time:.6g} s",
            "bodies": short_list(body.name for body in this.system.bodies),
            "status": str(report.status),
            "smallest J": f"{report.min_det_F:.4g}",
        }


class DisplayedReport(Displayed):
    """The report of a frame."""

    def _facts(self) -> Mapping[str, str]:
        this: Any = self
        facts = {
            "status": str(this.status),
            "smallest J": f"{this.min_det_F:.4g}",
            "kinetic energy": f"{this.kinetic_energy:.6g} J",
            "elastic energy": f"{this.elastic_energy:.6g} J",
            "potential energy": f"{this.potential_energy:.6g} J",
            "iterations": str(this.iterations),
            "step": f"{1e3 * this.wall_seconds:.3g} ms",
        }
        return facts | ({"message": this.message} if this.message else {})


def short_list(names: Any) -> str:
    """Names with commas; of many, the first ones and their number."""
    every = list(names)
    return ", ".join(every) if len(every) <= 4 else f"{', '.join(every[:3])} and {len(every) - 3} more"


def extent(points: Any) -> str:
    """The size of the bounding box of (n, 3) points [m]."""
    return " x ".join(f"{length:.4g}" for length in points.max(axis=0) - points.min(axis=0)) + " m"
