"""The client of all pages, one HTML file that the wheel contains; it imports little, as a server shows it at once."""

from __future__ import annotations

import html
from importlib.resources import files

from supple.errors import OutputError

DATA = "<!--data-->"  # what stands where a page has its frames
_TITLE = "<title>Supple</title>"


def client(title: str) -> str:
    """The page without frames, which asks the server that sent it for them."""
    try:
        page = files("supple.results.page").joinpath("page.html").read_text(encoding="utf-8")
        return page.replace(_TITLE, f"<title>{html.escape(title)} · Supple</title>", 1)
    except OSError:
        raise OutputError("page: the client is not built; run `python client/build.py` in the checkout") from None
