"""Figures of matplotlib in one style: thin lines, serif type, legends below the axes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from supple.errors import OutputError
from supple.runtime.replacing import whole_file

KINDS = ("png", "pdf", "svg")
MOST_ENTRIES = 6
"""Of a legend; it counts the other lines, which are grey."""
REST_COLOR = "0.72"
# A legend is as wide as the axes: so many letters of its size fit into an inch, and a handle takes so many.
_LETTERS_OF_INCH, _LETTERS_OF_HANDLE, _LONGEST = 16.0, 5, 28
# Below the axes: tick labels and the label of the axis [points].
_LEGEND_DROP = 31.0
# An axis whose ends have at least this ratio is logarithmic.
_LOGARITHMIC = 50.0
_STYLE: Any = {  # of types that only the stubs of matplotlib have
    "font.family": ["STIXGeneral", "DejaVu Serif"],
    "mathtext.fontset": "stix",
    "font.size": 11.0,
    "axes.labelsize": 11.0,
    "axes.titlesize": 12.0,
    "xtick.labelsize": 10.0,
    "ytick.labelsize": 10.0,
    "legend.fontsize": 10.0,
    "legend.frameon": False,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.xmargin": 0.02,
    "grid.color": "0.9",
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.4,
    "axes.prop_cycle": "cycler('color', ['#30638e', '#d1495b', '#3a7d44', '#edae49', '#7a3e9d', '#5ba3d0'])",
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "axes.formatter.use_mathtext": True,
    "axes.formatter.limits": (-3, 4),
    "svg.fonttype": "none",
}


@contextmanager
def paper_figure(path: Path, width: float, height: float) -> Iterator[Any]:
    """A figure of a size [in] that is written to `path` as its ending says, once it is drawn.

    Raises
    ------
    OutputError : where no such format exists, or the system refuses.
    """
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    kind = path.suffix[1:].lower()
    if kind not in KINDS and not path.is_dir():
        raise OutputError(f"{path}: picture format {path.suffix!r} does not exist; take .png, .pdf or .svg")
    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=(width, height), layout="constrained", dpi=150)
        FigureCanvasAgg(figure)
        figure.get_layout_engine().set(h_pad=0.08, w_pad=0.08)  # type: ignore[union-attr]
        yield figure
        with whole_file(path) as fresh:
            made = (
                BytesIO()
            )  # where the disk is full, matplotlib's writer of PDF files raises other errors than OSError
            figure.savefig(made, format=kind)
            fresh.write_bytes(made.getvalue())


def legend_below(axis: Any) -> None:
    """Name the first six of the lines with a label below the axes, and how many more there are."""
    from matplotlib.lines import Line2D
    from matplotlib.transforms import ScaledTranslation

    handles, labels = axis.get_legend_handles_labels()
    names = [label if len(label) <= _LONGEST else f"{label[: _LONGEST - 1]}…" for label in labels[:MOST_ENTRIES]]
    if not names:
        return
    handles, rest = handles[:MOST_ENTRIES], handles[MOST_ENTRIES:]
    if rest:
        names.append(f"… and {len(rest)} more")
        handles.append(Line2D([], [], color=REST_COLOR))
    for line in rest:
        line.set(color=REST_COLOR, linewidth=0.8, zorder=1.5)
    figure = axis.figure
    # Before the layout, the axes have the width that their grid gives them, and labels on the left take some of it.
    inches = 0.85 * figure.get_figwidth() / axis.get_subplotspec().get_gridspec().ncols
    columns = int(inches * _LETTERS_OF_INCH / (max(map(len, names)) + _LETTERS_OF_HANDLE))
    axis.legend(
        handles,
        names,
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        bbox_transform=axis.transAxes + ScaledTranslation(0.0, -_LEGEND_DROP / 72.0, figure.dpi_scale_trans),
        borderaxespad=0.0,
        ncols=max(1, min(columns, len(names))),
        handlelength=1.6,
        columnspacing=1.4,
        labelspacing=0.3,
    )


def spans_decades(values: NDArray[Any]) -> bool:
    """Whether values belong on a logarithmic axis: all above zero, and the largest at least 50 times the smallest."""
    finite = values[np.isfinite(values)]
    return len(finite) > 0 and finite.min() > 0.0 and finite.max() >= _LOGARITHMIC * finite.min()
