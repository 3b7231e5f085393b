"""A suggestion for an unknown name."""

from __future__ import annotations

import difflib
from collections.abc import Sequence


def suggestion(name: str, known: Sequence[str]) -> str:
    """The known name most similar to `name`, or a list of known names."""
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.6)
    if near:
        return f"did you mean {near[0]!r}?"
    listed = ", ".join(map(repr, known[:12]))
    return f"there are {listed}{', ...' if len(known) > 12 else ''}"
