"""Access control in front of the server of viser: tokens, other sites, malformed messages."""

import contextlib
import http.client
import io
import os
import random
import socket
import time
import urllib.error
import urllib.request

import msgspec
import pytest
import viser
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from supple.app.viewer.protocol import limits
from supple.app.viewer.server.gate import Allowance, first_free_port, gate, is_loopback, new_token, require_free_port
from supple.app.viewer.server.message_check import Malformed, is_wanted
from supple.app.viewer.server.uploads.transfers import refuse_transfers
from supple.errors import OutputError
from supple.results.viser_server import temporary_server

PROTOCOL = f"viser-v{viser.__version__}"
TIMEOUT = 30.0


@contextlib.contextmanager
def served(host="127.0.0.1", token=None, port=0):
    with contextlib.redirect_stdout(io.StringIO()):
        with gate(host, token):
            server = viser.ViserServer(host=host, port=port, verbose=False)
        try:
            yield server
        finally:
            server.stop()


@pytest.fixture(scope="module")
def local():
    with served() as server:
        yield server


@pytest.fixture(scope="module")
def secret():
    token = new_token()
    with served("127.0.0.1", token) as server:
        yield server, token


def dial(server, path="", **headers):
    url = f"ws://127.0.0.1:{server.get_port()}{path}"
    return connect(url, subprotocols=[PROTOCOL], additional_headers=headers, open_timeout=TIMEOUT, max_size=None)


def fetch(server, path="/", **headers):
    request = urllib.request.Request(f"http://127.0.0.1:{server.get_port()}{path}", headers=headers)
    with urllib.request.urlopen(request, timeout=TIMEOUT) as response:
        return response.status, response.headers, response.read()


def camera(**changes):
    message = {
        "type": "ViewerCameraMessage",
        "wxyz": [1, 0, 0, 0],
        "position": [0.0, 1, 2.5],
        "fov": 0.8,
        "near": 0.01,
        "far": 1000,
        "image_height": 600,
        "image_width": 800.5,
        "look_at": [0, 0, 0],
        "up_direction": [0, 1, 0],
    }
    return msgspec.msgpack.encode({key: value for key, value in (message | changes).items() if value is not ...})


def ended(connection):
    """The close code that the server gives; all messages before it are read and discarded."""
    try:
        for _ in range(10_000):
            connection.recv(timeout=TIMEOUT)
    except ConnectionClosed as end:
        return end.rcvd.code
    pytest.fail("the connection stays")


class TestToken:
    def test_without_token_neither_page_nor_websocket_is_served(self, secret):
        server, token = secret
        for path in ("/", "/?token=", "/?token=wrong", f"/?token={token[:-1]}", f"/?other={token}", "/index.html"):
            with pytest.raises(urllib.error.HTTPError) as caught:
                fetch(server, path)
            assert caught.value.code == 403
            assert b"token" in caught.value.read()
        for path, cookie in (("", ""), ("/?token=wrong", ""), ("", "supple-80=wrong"), ("", f"other={token}")):
            with pytest.raises(InvalidStatus) as refused:
                dial(server, path, Cookie=cookie)
            assert refused.value.response.status_code == 403

    def test_the_page_sets_a_cookie_that_its_websocket_uses(self, secret):
        server, token = secret
        status, headers, body = fetch(server, f"/?token={token}")
        assert status == 200
        assert b"<html" in body[:1000].lower()
        assert headers["Referrer-Policy"] == "no-referrer"
        cookie = headers["Set-Cookie"]
        assert {"HttpOnly", "SameSite=Strict"} <= {part.strip() for part in cookie.split(";")}
        with dial(server, Cookie=cookie.split(";")[0]) as connection:
            assert connection.recv(timeout=TIMEOUT)
        # and a reload of the page, without the token in its address
        assert fetch(server, "/", Cookie=cookie.split(";")[0])[0] == 200

    def test_other_clients_may_send_the_token_in_the_address(self, secret):
        server, token = secret
        with dial(server, f"/?token={token}") as connection:
            assert connection.recv(timeout=TIMEOUT)

    def test_other_machines_need_a_token(self):
        with pytest.raises(OutputError, match="needs a token"), served("0.0.0.0"):
            pass

    def test_tokens_differ_and_are_long(self):
        tokens = {new_token() for _ in range(100)}
        assert len(tokens) == 100
        assert min(map(len, tokens)) >= 24


class TestOtherSites:
    def test_a_page_of_another_site_cannot_open_the_websocket(self, local):
        port = local.get_port()
        for origin in ("http://evil.example", "null", f"http://127.0.0.1:{port + 1}", "file://"):
            with pytest.raises(InvalidStatus) as refused:
                dial(local, Origin=origin)
            assert refused.value.response.status_code == 403
        with dial(local, Origin=f"http://127.0.0.1:{port}") as connection:
            assert connection.recv(timeout=TIMEOUT)

    def test_no_other_page_may_show_this_one(self, local):
        headers = fetch(local)[1]
        assert headers["Content-Security-Policy"] == "frame-ancestors 'none'"
        assert headers["X-Frame-Options"] == "DENY"

    def test_an_address_with_other_letters_is_refused(self, local):
        with socket.create_connection(("127.0.0.1", local.get_port()), timeout=TIMEOUT) as raw:
            raw.sendall("GET /bär HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
            assert raw.recv(100).split()[1] == b"403"

    def test_a_foreign_host_name_is_refused(self, local):
        with pytest.raises(urllib.error.HTTPError) as caught:
            fetch(local, "/", Host="rebound.example:8080")
        assert caught.value.code == 403
        assert fetch(local, "/", Host="localhost:8080")[0] == 200

    @pytest.mark.parametrize("host", ["127.0.0.1", "127.8.8.8", "localhost", "::1", "[::1]"])
    def test_loopback_hosts(self, host):
        assert is_loopback(host)

    @pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.5", "example.org", "", "127.0.0.1.example.org"])
    def test_other_hosts(self, host):
        assert not is_loopback(host)


NAN = float("nan")
RANDOM = random.Random(7)
MALFORMED = {
    "random bytes": RANDOM.randbytes(500),
    "more random bytes": RANDOM.randbytes(60_000),
    "nothing": b"",
    "text": "hello",
    "a number": msgspec.msgpack.encode(7),
    "a list": msgspec.msgpack.encode([1, 2, 3]),
    "cut short": camera()[:-5],
    "deep nesting": b"\x91" * 5_000,
    "no kind": msgspec.msgpack.encode({"position": [0, 0, 0]}),
    "unknown kind": msgspec.msgpack.encode({"type": "__import__"}),
    "kind is no text": msgspec.msgpack.encode({"type": ["ViewerCameraMessage"]}),
    "a field too few": camera(fov=...),
    "a field too many": camera(__class__="x"),
    "not a number": camera(fov=NAN),
    "infinite": camera(position=[0.0, float("inf"), 0.0]),
    "a vector of four": camera(position=[0.0, 0.0, 0.0, 0.0]),
    "a vector of texts": camera(position=["0", "1", "2"]),
    "a text for a number": camera(near="0.1"),
    "large": msgspec.msgpack.encode({"type": "GuiUpdateMessage", "uuid": "a", "updates": {"value": "x" * 70_000}}),
    "an attribute of viser's own": msgspec.msgpack.encode(
        {"type": "GuiUpdateMessage", "uuid": "a", "updates": {"update_cb": []}}
    ),
    "a value within a value": msgspec.msgpack.encode(
        {"type": "GuiUpdateMessage", "uuid": "a", "updates": {"value": [[[[[[[[[[NAN]]]]]]]]]]}}
    ),
    "a drag from nowhere": msgspec.msgpack.encode(
        {"type": "SceneNodeDragMessage", "phase": "explode", "name": "/body"}
    ),
}


def part(size=10, **changes):
    fields = {"source_component_uuid": "a", "transfer_uuid": "b", "part_index": 0, "content": bytes(size)}
    return msgspec.msgpack.encode({"type": "FileTransferPart", **fields, **changes})


def file_start(**changes):
    fields = {
        "source_component_uuid": "a",
        "transfer_uuid": "b",
        "filename": "ball.stl",
        "mime_type": "",
        "part_count": 1,
        "size_bytes": 10,
    }
    return msgspec.msgpack.encode({"type": "FileTransferStartUpload", **fields, **changes})


MALFORMED |= {
    "a part of a file that is too large": part(limits.UPLOAD_PART + limits.LARGEST_MESSAGE + 1),
    "a part that is no bytes": part(content="x"),
    "a part with a field too many": part(path="/etc/passwd"),
    "a part without a number": part(part_index=NAN),
    "a file with a long name": file_start(filename="x" * 70_000),
    "a file with a folder of its own": file_start(folder="/tmp"),
    "a file of no size": file_start(size_bytes=None),
    "a file for nothing": file_start(source_component_uuid=None),
}


class TestMalformed:
    @pytest.mark.parametrize("name", MALFORMED)
    def test_a_malformed_message_closes_only_its_connection(self, local, name):
        with dial(local) as good, dial(local) as bad:
            good.send(camera())
            bad.send(MALFORMED[name])
            assert ended(bad) == 1008
            good.send(camera())
            good.ping().wait(TIMEOUT)

    def test_a_message_beyond_the_size_limit_is_not_read(self, local):
        with dial(local) as bad:
            with contextlib.suppress(ConnectionClosed):
                bad.send(b"\0" * (limits.LARGEST_PICTURE + 1))
            assert ended(bad) == 1009

    def test_too_many_messages_close_the_connection(self, local, monkeypatch):
        monkeypatch.setattr(limits, "MESSAGES_AT_ONCE", 50)
        monkeypatch.setattr(limits, "MESSAGES_PER_SECOND", 1)
        with dial(local) as bad:
            with contextlib.suppress(ConnectionClosed):
                for _ in range(60):
                    bad.send(camera())
            assert ended(bad) == 1008

    def test_a_browser_that_sends_nothing_is_disconnected(self, local, monkeypatch):
        with dial(local) as polite:
            polite.send(camera())
            monkeypatch.setattr(limits, "FIRST_MESSAGE", 0.3)
            with dial(local) as silent:
                assert ended(silent) == 1008
            polite.ping().wait(TIMEOUT)

    def test_the_number_of_pages_is_limited(self, local, monkeypatch):
        with dial(local) as first:
            first.ping().wait(TIMEOUT)
            monkeypatch.setattr(limits, "MOST_CLIENTS", 1)
            with dial(local) as second:
                assert ended(second) == 1013
            first.ping().wait(TIMEOUT)

    def test_the_number_of_silent_connections_is_limited(self, monkeypatch):
        monkeypatch.setattr(limits, "MOST_CONNECTIONS", 5)
        with served() as server, contextlib.ExitStack() as ends:
            place = ("127.0.0.1", server.get_port())
            silent = [ends.enter_context(socket.create_connection(place, timeout=TIMEOUT)) for _ in range(5)]
            for line in silent:
                line.sendall(b"GET / HTTP/1.1\r\n")
            one_more = ends.enter_context(socket.create_connection(place, timeout=TIMEOUT))
            with contextlib.suppress(ConnectionResetError):
                assert one_more.recv(100) == b""  # dropped
            silent[0].close()  # there is room again, once the server has noticed
            end = time.monotonic() + TIMEOUT
            while True:
                try:
                    assert fetch(server)[0] == 200
                    break
                except (OSError, http.client.HTTPException):
                    assert time.monotonic() < end, "no connection is accepted any more"
                    time.sleep(0.05)

    def test_requests_to_share_the_page_are_ignored(self):
        assert not is_wanted(msgspec.msgpack.encode({"type": "ShareUrlRequest"}))
        assert is_wanted(camera())

    def test_messages_of_uploads_are_passed_on(self):
        # `Transfers` decides later whether they are accepted.
        assert is_wanted(file_start())
        assert is_wanted(part(limits.UPLOAD_PART))

    def test_a_file_is_ignored_where_there_is_no_upload_button(self, local):
        """The page of a recording has none."""
        refuse_transfers(local)
        slider = local.gui.add_slider("youngs", min=0.0, max=10.0, step=0.5, initial_value=1.0)
        with dial(local) as connection:
            connection.send(camera())
            connection.send(file_start(source_component_uuid=slider._impl.uuid))
            connection.send(part(source_component_uuid=slider._impl.uuid))
            connection.ping().wait(TIMEOUT)
        assert slider.value == 1.0
        assert local.gui._current_file_upload_states == {}

    def test_random_changes_of_a_message_raise_nothing_but_malformed(self):
        rng, good, wanted = random.Random(1), camera(), 0
        for _ in range(3000):
            raw = bytearray(good)
            for _ in range(rng.randint(1, 3)):
                raw[rng.randrange(len(raw))] = rng.randrange(256)
            with contextlib.suppress(Malformed):
                wanted += is_wanted(bytes(raw))
        assert 0 < wanted < 3000

    def test_a_valid_slider_message_is_handled(self, local):
        slider = local.gui.add_slider("youngs", min=0.0, max=10.0, step=0.5, initial_value=1.0)
        update = {"type": "GuiUpdateMessage", "uuid": slider._impl.uuid, "updates": {"value": 7}}
        with dial(local) as connection:
            connection.send(camera())
            connection.send(msgspec.msgpack.encode(update))
            end = time.monotonic() + TIMEOUT
            while slider.value != 7.0 and time.monotonic() < end:
                time.sleep(0.01)
        assert slider.value == 7.0


class TestPort:
    def test_a_server_can_restart_at_the_same_port(self):
        # Not a port that the system selects: another process may use it before the server restarts.
        port = first_free_port("127.0.0.1", 20_000 + 50 * (os.getpid() % 200) + 25)
        with served(port=port) as server, dial(server) as connection:
            connection.recv(timeout=TIMEOUT)
            server.stop()
            assert ended(connection) in (1001, 1006, 1012)
        for _ in range(2):
            require_free_port("127.0.0.1", port)
            with served(port=port) as again:
                assert again.get_port() == port
                with dial(again) as connection:
                    assert connection.recv(timeout=TIMEOUT)

    def test_a_used_port_is_refused(self):
        with socket.socket() as other:
            other.bind(("127.0.0.1", 0))
            other.listen()
            with pytest.raises(OutputError, match="--port"):
                require_free_port("127.0.0.1", other.getsockname()[1])

    def test_the_first_free_port_is_found(self):
        with socket.socket() as other:
            other.bind(("127.0.0.1", 0))
            other.listen()
            taken = other.getsockname()[1]
            assert taken < first_free_port("127.0.0.1", taken) <= taken + 19

    def test_a_host_of_another_machine_is_refused(self):
        with pytest.raises(OutputError, match=r"192\.0\.2\.1"):
            require_free_port("192.0.2.1", 8080)


def test_a_server_without_access_check_is_refused():
    with pytest.raises(OutputError, match="cannot be protected"), gate("127.0.0.1"):
        pass


def test_a_token_bucket_refills_with_time():
    allowance = Allowance(rate=10.0, most=3.0)
    assert [allowance.take(5.0) for _ in range(4)] == [True, True, True, False]
    assert not allowance.take(5.05)
    assert allowance.take(5.2)
    assert [allowance.take(99.0) for _ in range(4)] == [True, True, True, False]


def test_a_server_that_writes_a_page_refuses_every_request():
    with temporary_server() as server:
        with pytest.raises(urllib.error.HTTPError) as caught:
            fetch(server)
        assert caught.value.code == 403
        with pytest.raises(InvalidStatus):
            dial(server)
