"""Wall time of a step by its parts."""

from __future__ import annotations

from collections import defaultdict
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from time import perf_counter

# What is reported; the rest of a step is "other".
PARTS = ("elasticity", "contact", "joints", "linear_solve")


@dataclass(eq=False)
class Clock:
    """Seconds since the last `restart`, by name of the part."""

    seconds: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    start: float = 0.0
    _spans: dict[str, _Span] = field(default_factory=dict)

    def restart(self) -> None:
        """Begin a step."""
        self.seconds.clear()
        self.start = perf_counter()

    def of(self, name: str) -> AbstractContextManager[None]:
        """Count the time of a block under a name; no block of that name may be in it."""
        span = self._spans.get(name)
        if span is None:
            span = self._spans[name] = _Span(self.seconds, name)
        return span

    def shares(self) -> dict[str, float]:
        """Seconds since the step began, of each of `PARTS` and of all else, named "other"."""
        shares = {name: self.seconds[name] for name in PARTS}
        return {**shares, "other": perf_counter() - self.start - sum(shares.values())}


class _Span(AbstractContextManager[None]):
    """A block whose time is counted; a class, since a generator takes several times longer to enter and leave."""

    __slots__ = ("name", "seconds", "start")

    def __init__(self, seconds: dict[str, float], name: str) -> None:
        self.seconds, self.name, self.start = seconds, name, 0.0

    def __enter__(self) -> None:
        self.start = perf_counter()

    def __exit__(self, *error: object) -> None:
        self.seconds[self.name] += perf_counter() - self.start
