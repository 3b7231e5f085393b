"""The gate before the page: tokens, other sites, nonsense, many connections."""

import contextlib
import http.client
import logging
import random
import socket
import time
import urllib.error
import urllib.request

import pytest
from tests.app.viewer.page.conftest import served_page, two_boxes
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from supple.app.viewer import gate
from supple.app.viewer.gate import new_token
from supple.app.viewer.server import require_free_port
from supple.errors import OutputError

TIMEOUT = 30.0
TOKEN = "the-token-of-the-tests"


@pytest.fixture(scope="module")
def server():
    with served_page(two_boxes()) as server:
        yield server


def dial(server, path=f"/?token={TOKEN}", **headers):
    url = f"ws://127.0.0.1:{server.port}{path}"
    return connect(url, additional_headers=headers, open_timeout=TIMEOUT, max_size=None)


def fetch(server, path=f"/?token={TOKEN}", **headers):
    request = urllib.request.Request(f"http://127.0.0.1:{server.port}{path}", headers=headers)
    with urllib.request.urlopen(request, timeout=TIMEOUT) as response:
        return response.status, response.headers, response.read()


def refused(server, path=f"/?token={TOKEN}", **headers):
    """Whether both the page and its websocket are refused, and the reason."""
    with pytest.raises(urllib.error.HTTPError) as caught:
        fetch(server, path, **headers)
    with pytest.raises(InvalidStatus) as upgrade:
        dial(server, path, **headers)
    assert (caught.value.code, upgrade.value.response.status_code) == (403, 403)
    return caught.value.read().decode()


def ended(connection):
    """The close code that the server gives; all messages before it are read and discarded."""
    try:
        for _ in range(10_000):
            connection.recv(timeout=TIMEOUT)
    except ConnectionClosed as end:
        return end.rcvd.code
    pytest.fail("the connection stays")


@pytest.mark.parametrize(
    "path",
    ["/", "/?token=", "/?token=wrong", f"/?token={TOKEN[:-1]}", f"/?other={TOKEN}", "/index.html", "/%ff?token=%ff"],
)
def test_neither_page_nor_websocket_is_served_without_the_token(server, path):
    assert "token" in refused(server, path)


@pytest.mark.parametrize("cookie", ["supple-80=wrong", f"other={TOKEN}", f"supple-1={TOKEN}", ";;;=", "=" + TOKEN])
def test_other_cookies_are_refused(server, cookie):
    assert "token" in refused(server, "/", Cookie=cookie)


def test_the_page_sets_a_cookie_that_its_websocket_uses(server):
    status, headers, body = fetch(server)
    assert status == 200
    assert b"<html" in body[:1000].lower()
    assert b"<title>boxes \xc2\xb7 Supple</title>" in body
    assert headers["Referrer-Policy"] == "no-referrer"
    cookie = headers["Set-Cookie"]
    assert {"HttpOnly", "SameSite=Strict"} <= {part.strip() for part in cookie.split(";")}
    with dial(server, "", Cookie=cookie.split(";")[0]) as connection:
        assert connection.recv(timeout=TIMEOUT)
    # and a reload of the page, without the token in its address
    assert fetch(server, "/", Cookie=cookie.split(";")[0])[0] == 200


def test_tokens_differ_and_are_long():
    tokens = {new_token() for _ in range(100)}
    assert len(tokens) == 100
    assert min(map(len, tokens)) >= 24


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:1", "file://", ""])
def test_a_page_of_another_site_is_refused_though_its_browser_holds_the_cookie(server, origin):
    cookie = fetch(server)[1]["Set-Cookie"].split(";")[0]
    assert "another site" in refused(server, "/", Cookie=cookie, Origin=origin)


def test_the_page_itself_is_let_in(server):
    with dial(server, Origin=f"http://127.0.0.1:{server.port}") as connection:
        assert connection.recv(timeout=TIMEOUT)


@pytest.mark.parametrize(
    "host", ["rebound.example:8080", "192.168.1.5", "", "[", "127.0.0.1.example.org", "localhost:x"]
)
def test_a_foreign_host_name_is_refused(server, host):
    with pytest.raises(urllib.error.HTTPError) as caught:
        fetch(server, Host=host)
    assert caught.value.code in (400, 403)


@pytest.mark.parametrize("host", ["localhost:8080", "127.0.0.1", "[::1]:9000"])
def test_hosts_of_this_machine_and_of_tunnels_are_served(server, host):
    assert fetch(server, Host=host)[0] == 200


def test_two_hosts_are_refused(server):
    with socket.create_connection(("127.0.0.1", server.port), timeout=TIMEOUT) as raw:
        raw.sendall(f"GET /?token={TOKEN} HTTP/1.1\r\nHost: localhost\r\nHost: evil.example\r\n\r\n".encode())
        assert raw.recv(100).split()[1] == b"403"


def test_a_page_of_another_site_in_a_browser_reaches_nothing(server, browser):
    """The browser holds the cookie, and runs the script of a page at another port."""
    context = browser.new_context()
    own = context.new_page()
    own.goto(f"http://127.0.0.1:{server.port}/?token={TOKEN}")
    foreign = context.new_page()
    foreign.route("http://evil.example/", lambda route: route.fulfill(body="<html></html>", content_type="text/html"))
    foreign.goto("http://evil.example/")
    port, token = server.port, TOKEN
    opened = foreign.evaluate(
        f"""() => Promise.all(["/", "/?token={token}"].map((path) => new Promise((resolve) => {{
          const line = new WebSocket("ws://127.0.0.1:{port}" + path);
          line.onopen = () => resolve("open");
          line.onerror = () => resolve("refused");
        }})))"""
    )
    read = foreign.evaluate(
        f"""() => fetch("http://127.0.0.1:{port}/", {{ credentials: "include" }})
          .then((answer) => answer.text(), () => "nothing")"""
    )
    framed = foreign.evaluate(
        f"""() => new Promise((resolve) => {{
          const frame = document.createElement("iframe");
          frame.onload = () => resolve(frame.contentDocument === null ? "closed" : "open");
          frame.src = "http://127.0.0.1:{port}/?token={token}";
          document.body.append(frame);
        }})"""
    )
    assert (opened, read, framed) == (["refused", "refused"], "nothing", "closed")
    assert all(not frame.query_selector("canvas") for frame in foreign.frames[1:])
    context.close()


RANDOM = random.Random(7)
NONSENSE = {
    "random bytes": RANDOM.randbytes(60_000),
    "nothing": b"",
    "text": "hello",
    "deep nesting": "[" * 20_000,
    "deep objects": '{"a":' * 10_000,
    "a number": "1e999",
    "no act": "{}",
    "an unknown act": '{"act": "__import__"}',
    "an act that is a list": '{"act": ["Play"]}',
    "unknown fields": '{"act": "Play", "body": 1}',
    "a method": '{"act": "put", "kind": "x", "message": "y"}',
    "infinity": '{"act": "grab", "point": [Infinity, 0, 0], "target": [0, 0, NaN]}',
    "a huge number": '{"act": "SetSpeed", "factor": 1' + "0" * 5000 + "}",
    "no point": '{"act": "grab", "point": "here", "target": null}',
    "an unknown solver": '{"act": "SetSolver", "kind": "<script>"}',
    "an unknown field": '{"act": "view", "field": [], "contacts": 3}',
    "a release of nothing": '{"act": "release"}',
    "a surrogate": '{"act": "\\ud800"}',
}


@pytest.mark.parametrize("name", NONSENSE)
def test_nonsense_does_not_reach_other_connections(server, name, caplog):
    with dial(server) as good, contextlib.suppress(ConnectionClosed), dial(server) as bad:
        bad.send(NONSENSE[name])
        good.ping().wait(TIMEOUT)
    assert fetch(server)[0] == 200
    assert all(record.exc_info is None for record in caplog.records if record.levelno >= logging.ERROR)


def test_a_message_beyond_the_size_limit_is_not_read(server):
    with dial(server) as bad:
        with contextlib.suppress(ConnectionClosed):
            bad.send(b"\0" * (gate.LARGEST_MESSAGE + 1))
        assert ended(bad) == 1009


@pytest.mark.parametrize("path", ["/index.html", "/../etc/passwd", "/%2e%2e/", "/data"])
def test_nothing_but_the_page_is_served(server, path):
    with pytest.raises(urllib.error.HTTPError) as caught:
        fetch(server, f"{path}?token={TOKEN}")
    assert caught.value.code in (403, 404)


def test_the_page_may_ask_nobody_else(server):
    policy = fetch(server)[1]["Content-Security-Policy"]
    assert policy.startswith("default-src 'none'")
    assert "frame-ancestors 'none'" in policy
    assert f"connect-src 'self' ws://127.0.0.1:{server.port};" in policy


def test_a_thousand_connections_are_survived(server):
    place = ("127.0.0.1", server.port)
    with dial(server) as good, contextlib.ExitStack() as ends:
        for k in range(1000):
            silent = ends.enter_context(socket.create_connection(place, timeout=TIMEOUT))
            if k % 2:
                silent.sendall(b"GET / HTTP/1.1\r\n")
        good.ping().wait(TIMEOUT)
    end = time.monotonic() + 60.0
    while True:  # the server may have run out of files meanwhile
        try:
            assert fetch(server)[0] == 200
            break
        except (OSError, http.client.HTTPException):
            assert time.monotonic() < end, "no connection is accepted any more"
            time.sleep(0.1)


def test_a_server_can_restart_at_the_same_port():
    with served_page(two_boxes()) as server, dial(server) as connection:
        connection.recv(timeout=TIMEOUT)
        port = server.port
    for _ in range(2):
        require_free_port(port)
        with served_page(two_boxes(), port) as again:
            assert again.port == port
            assert fetch(again)[0] == 200


def test_the_next_free_port_is_taken(server):
    with served_page(two_boxes(), server.port) as other:
        assert server.port < other.port <= server.port + 200


def test_a_used_port_is_refused(server):
    with pytest.raises(OutputError, match="--port"):
        require_free_port(server.port)


def test_only_the_loopback_interface_is_served(server):
    addresses = {info[4][0] for info in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)}
    for address in addresses - {"127.0.0.1", "127.0.1.1"}:
        with pytest.raises(OSError, match="refused"):
            socket.create_connection((address, server.port), timeout=5.0)
