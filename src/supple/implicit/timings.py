"""Wall time of a step by its parts."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import perf_counter

# What is reported; the rest of a step is "other".
PARTS = ("elasticity", "contact", "linear_solve")


@dataclass(eq=False)
class Clock:
    """Seconds since the last `restart`, by name of the part."""

    seconds: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    start: float = 0.0

    def restart(self) -> None:
        """Begin a step."""
        self.seconds.clear()
        self.start = perf_counter()

    @contextmanager
    def of(self, name: str) -> Iterator[None]:
        """Count the time of a block under a name."""
        start = perf_counter()
        try:
            yield
        finally:
            self.seconds[name] += perf_counter() - start

    def shares(self) -> dict[str, float]:
        """Seconds since the step began, of each of `PARTS` and of all else, named "other"."""
        shares = {name: self.seconds[name] for name in PARTS}
        return {**shares, "other": perf_counter() - self.start - sum(shares.values())}
