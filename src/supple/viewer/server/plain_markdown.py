"""Text from elsewhere, in places of the page that take Markdown."""

from __future__ import annotations


def plain(text: str) -> str:
    """Markdown that shows just this text: browsers run what HTML in Markdown says, and names are anyone's."""
    return "".join(c if c.isalnum() or c in " .,:;'()/-+=%" else f"&#{ord(c)};" for c in text)
