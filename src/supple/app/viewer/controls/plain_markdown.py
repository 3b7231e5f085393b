"""Escapes text for the Markdown elements of the page."""

from __future__ import annotations


def plain(text: str) -> str:
    """Markdown that displays exactly this text. Browsers interpret HTML in Markdown, and names can contain anything."""
    return "".join(c if c.isalnum() or c in " .,:;'()/-+=%" else f"&#{ord(c)};" for c in text)
