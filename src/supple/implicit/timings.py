"""Where the time of a step goes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import perf_counter


@dataclass(eq=False)
class Clock:
    """Seconds spent since the last `restart`, by name."""

    seconds: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    began: float = 0.0

    def restart(self) -> None:
        """Begin a step."""
        self.seconds.clear()
        self.began = perf_counter()

    @contextmanager
    def of(self, name: str) -> Iterator[None]:
        """Count the time of a block under a name."""
        began = perf_counter()
        try:
            yield
        finally:
            self.seconds[name] += perf_counter() - began

    def shares(self) -> dict[str, float]:
        """Seconds by name since the step began; what has no name is `other`."""
        named = {name: value for name, value in self.seconds.items() if name != "other"}
        return {**named, "other": perf_counter() - self.began - sum(named.values())}
