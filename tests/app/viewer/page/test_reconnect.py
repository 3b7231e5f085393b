"""A page displays that its server has ended, and reconnects to a new one."""

import os

import pytest

from supple.app.viewer.app import configure_page
from supple.app.viewer.live_page import LivePage
from supple.app.viewer.server.gate import first_free_port
from supple.results.viser_server import start_server, stop_server


def serve(port, simulation):
    server = start_server("127.0.0.1", port)
    configure_page(server)
    return server, LivePage(server, simulation, simulation.snapshot)


@pytest.mark.slow
def test_the_page_reconnects_to_a_restarted_server(fake, look, spot):
    # Not a port that the system selects: another process may use it before the server restarts.
    server, page = serve(first_free_port("127.0.0.1", 20_000 + 50 * (os.getpid() % 200)), fake)
    screen = look(f"http://127.0.0.1:{server.get_port()}", server)
    connected = screen.tab.get_by_text("Connected", exact=True)
    screen.wait(lambda: connected.count() == 1 and spot(screen.shot(), "red")[0] > 100, "the page")
    port = server.get_port()
    page.stop()
    stop_server(server)
    screen.wait(lambda: screen.tab.get_by_text("Connecting...").count() == 1, "word that the server is gone")
    assert connected.count() == 0
    # The last picture stays.
    assert spot(screen.shot(), "red")[0] > 100
    before = spot(screen.shot(), "red")[1]
    fake.show(positions=fake.snapshot.positions[::-1].copy())  # the bodies exchange their positions
    server, page = serve(port, fake)
    try:
        assert server.get_port() == port
        screen.wait(lambda: connected.count() == 1, "the connection")
        screen.wait(lambda: spot(screen.shot(), "red")[1][0] > before[0] + 50, "the new state in the picture")
    finally:
        screen.close()
        page.stop()
        stop_server(server)
    assert [error for error in screen.errors if "WebSocket" not in error] == []
