"""Wall time of a step by its parts."""

from __future__ import annotations

from collections import defaultdict
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from time import perf_counter

# What is reported; the rest of a step is "other".
PARTS = ("elasticity", "contact", "joints", "linear_solve")


@dataclass(eq=False)
class Clock(AbstractContextManager[None]):
    """Seconds since the last `restart`, by name of the part."""

    seconds: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    start: float = 0.0
    _name: str = ""
    _began: float = 0.0

    def restart(self) -> None:
        """Begin a step."""
        self.seconds.clear()
        self.start = perf_counter()

    def of(self, name: str) -> Clock:
        """Count the time of a block under a name; blocks are not within each other."""
        self._name = name
        return self

    def __enter__(self) -> None:
        self._began = perf_counter()

    def __exit__(self, *error: object) -> None:
        self.seconds[self._name] += perf_counter() - self._began

    def shares(self) -> dict[str, float]:
        """Seconds since the step began, of each of `PARTS` and of all else, named "other"."""
        shares = {name: self.seconds[name] for name in PARTS}
        return {**shares, "other": perf_counter() - self.start - sum(shares.values())}
