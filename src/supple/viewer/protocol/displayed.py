"""How messages display a value that came from outside."""

from __future__ import annotations


def displayed(value: object) -> str:
    """Any value as text on one short line."""
    try:
        text = " ".join(repr(value).split())
    except Exception:  # `repr` of an unknown class may raise anything
        text = type(value).__name__
    return text if len(text) <= 60 else text[:57] + "..."
