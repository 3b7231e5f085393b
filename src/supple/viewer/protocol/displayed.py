"""How messages show a value that came from outside."""

from __future__ import annotations


def displayed(value: object) -> str:
    """A value on one short line, whatever it is."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # a value of a foreign class may do anything
        text = type(value).__name__
    return text if len(text) <= 60 else text[:57] + "..."
