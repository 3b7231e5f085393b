"""The gate before the page: it lets in only those who hold the token of a page.

The server listens on the loopback interface. Other users of the machine reach it there, and so do pages of other sites
in the user's browser. Who passes the gate is the user.
"""

from __future__ import annotations

import hmac
import http
import secrets
from typing import Any
from urllib.parse import parse_qs, urlsplit

_HOSTS = ("localhost", "127.0.0.1", "::1")
LARGEST_MESSAGE = 64 * 2**10  # of a browser, of which commands are the largest [bytes]
_HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",  # the address contains the token
    "X-Content-Type-Options": "nosniff",
}
# The page has all that it needs, and asks nobody else. A page of another site may not show this one within itself,
# where clicks would be led astray.
_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; font-src data:; "
    "connect-src 'self' ws://{host}; frame-ancestors {framing}; base-uri 'none'; form-action 'none'"
)
# Notebooks of this machine show the page in a frame. Its address has the secret that another page does not know.
_NOTEBOOKS = "http://localhost:* http://127.0.0.1:* https://localhost:* https://127.0.0.1:* vscode-webview:"


def new_token() -> str:
    """A secret for the address of a page."""
    return secrets.token_urlsafe(18)


class Gate:
    """Decides on requests, by their address and their headers.

    Parameters
    ----------
    token : the address, or the cookie that the page sets, must contain it
    page : the HTML; framed : whether notebooks may show it in a frame
    """

    def __init__(self, token: str, page: str, *, framed: bool = False) -> None:
        self._token, self._page, self._framed = token.encode(), page, framed

    def answer(self, connection: Any, request: Any) -> Any:
        """The answer to a request: a refusal, the page, or None, which opens a websocket."""
        why = self.refusal(request.path, request.headers)
        if why is not None:
            return connection.respond(http.HTTPStatus.FORBIDDEN, f"Supple: {why}\n")
        if "Upgrade" in request.headers:
            return None
        if urlsplit(request.path).path != "/":
            return connection.respond(http.HTTPStatus.NOT_FOUND, "Supple: only the page is here\n")
        host = request.headers["Host"]
        response = connection.respond(http.HTTPStatus.OK, self._page)
        del response.headers["Content-Type"]
        policy = _POLICY.format(host=host, framing=_NOTEBOOKS if self._framed else "'none'")
        headers = {"Content-Type": "text/html; charset=utf-8", "Content-Security-Policy": policy}
        headers |= {} if self._framed else {"X-Frame-Options": "DENY"}
        for name, value in {**_HEADERS, **headers}.items():
            response.headers[name] = value
        # The browser also sends it when it opens the websocket.
        cookie = f"{_cookie_name(host)}={self._token.decode()}"
        response.headers["Set-Cookie"] = f"{cookie}; HttpOnly; SameSite=Strict; Path=/"
        return response

    def refusal(self, path: str, headers: Any) -> str | None:
        """Why a request is refused, or None."""
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        if len(hosts) != 1 or _address(hosts[0])[0] not in _HOSTS:
            # A page of another site whose host name resolves to this machine (DNS rebinding).
            return "this page is served on this machine only: use http://localhost"
        if any(urlsplit(origin).netloc.lower() != hosts[0].lower() for origin in origins):
            return "a page of another site may not use this one"
        if not self._holds_token(path) and not self._is_cookie(headers.get_all("Cookie"), hosts[0]):
            return "the address needs its token (?token=...); use the address in the terminal"
        return None

    def _holds_token(self, path: str) -> bool:
        return any(self._is_token(item) for item in parse_qs(urlsplit(path).query).get("token", []))

    def _is_cookie(self, lines: list[str], host: str) -> bool:
        pairs = (pair.strip().partition("=") for line in lines for pair in line.split(";"))
        return any(name == _cookie_name(host) and self._is_token(value) for name, _, value in pairs)

    def _is_token(self, value: str) -> bool:
        return hmac.compare_digest(value.encode("utf-8", "replace"), self._token)


def _address(host: str) -> tuple[str, int | None]:
    """The name and the port of a Host header; "" where it has none."""
    try:
        parts = urlsplit("//" + host)
        return parts.hostname or "", parts.port
    except ValueError:
        return "", None


def _cookie_name(host: str) -> str:
    # Browsers send cookies to every port of a host: each server has its own cookie.
    return f"supple-{_address(host)[1] or 80}"
