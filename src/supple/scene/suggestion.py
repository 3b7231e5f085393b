"""What to say of a name that nothing has."""

from __future__ import annotations

import difflib
from collections.abc import Sequence


def suggestion(name: str, known: Sequence[str]) -> str:
    """The known name that was probably meant, or what there is."""
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.6)
    if near:
        return f"did you mean {near[0]!r}?"
    shown = ", ".join(map(repr, known[:12]))
    return f"there are {shown}{', ...' if len(known) > 12 else ''}"
