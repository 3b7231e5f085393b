"""What reading a file had to change or leave out, for one line of the log a kind."""

from __future__ import annotations

from supple.app.scene_file.yaml_files import printable

_MOST = 4  # names in a line


class Notes:
    """By what was done, the names of the things that it was done to."""

    def __init__(self) -> None:
        self._names: dict[str, dict[str, None]] = {}

    def add(self, what: str, name: str) -> None:
        """Note that `what` was done to the thing `name`."""
        self._names.setdefault(what, {})[name] = None

    def lines(self) -> list[str]:
        """One line for each kind, with the first names."""
        lines = []
        for what, names in self._names.items():
            first = ", ".join(printable(name) for name in list(names)[:_MOST])
            more = f" and {len(names) - _MOST} more" if len(names) > _MOST else ""
            lines.append(f"{what}: {first}{more}")
        return lines
