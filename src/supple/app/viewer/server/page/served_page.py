"""The page that browsers get: that of viser's client, with our title, style and script.

viser's client is one file. A small loader in it decodes the program and starts it; `page.js` changes the decoded
program in a few places, each found by a pattern, and adds what is drawn above the picture.
"""

from __future__ import annotations

import gzip
import html
from functools import cached_property
from pathlib import Path
from typing import Any

from supple.errors import OutputError

_HERE = Path(__file__).parent
# The statement of the loader that starts the decoded program.
_START = "e.textContent=code;"
_CHANGED_START = "e.textContent=suppleChanges(code);"
_TITLE = "<title>Viser</title>"


class ServedPage:
    """The page with a title.

    Parameters
    ----------
    title : of the browser's tab

    Raises
    ------
    OutputError : where viser's client is not one that can be changed.
    """

    def __init__(self, title: str) -> None:
        self.title = title
        self._plain = _changed(_client(), title).encode()

    @cached_property
    def _packed(self) -> bytes:
        return gzip.compress(self._plain)

    def replace(self, response: Any) -> None:
        """Replace the body of viser's answer, where it is the page."""
        if response.status_code != 200 or not response.headers.get("Content-Type", "").startswith("text/html"):
            return
        response.body = self._packed if response.headers.get("Content-Encoding") == "gzip" else self._plain
        del response.headers["Content-Length"]
        response.headers["Content-Length"] = str(len(response.body))


def _client() -> str:
    import viser

    return (Path(viser.__file__).parent / "client" / "build" / "index.html").read_text(encoding="utf-8")


def _changed(client: str, title: str) -> str:
    if _START not in client or _TITLE not in client:
        raise OutputError("this version of viser has another client; install viser 1.1.1")
    style, script = ((_HERE / name).read_text(encoding="utf-8") for name in ("page.css", "page.js"))
    ours = f"<title>{html.escape(title[:80])} · Supple</title>\n<style>{style}</style>\n<script>{script}</script>"
    return client.replace(_START, _CHANGED_START, 1).replace(_TITLE, ours, 1)
