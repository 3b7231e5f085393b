"""Times as numbers or fractions: 0.02, or 1/60."""

from __future__ import annotations


def number_or_fraction(text: str) -> float:
    """The value of a number, or of a fraction of two numbers.

    Raises
    ------
    ValueError : where the text is neither, or divides by zero.
    """
    above, slash, below = text.partition("/")
    try:
        return float(above) / float(below) if slash else float(above)
    except ZeroDivisionError:
        raise ValueError(f"{text!r} divides by zero") from None
