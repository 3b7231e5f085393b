"""A page displays that its server has ended, and reconnects to a new one."""

from contextlib import contextmanager

import pytest
from tests.app.viewer.page.conftest import TOKEN

from supple.app.viewer.app import configure_page
from supple.app.viewer.live_page import LivePage
from supple.results.view.server import gated_server


@contextmanager
def served(port, simulation):
    with gated_server(TOKEN, port) as server:
        configure_page(server, "boxes")
        page = LivePage(server, simulation, simulation.snapshot)
        try:
            yield server
        finally:
            page.stop()


@pytest.mark.slow
def test_the_page_reconnects_to_a_restarted_server(fake, look, spot):
    with served(0, fake) as server:
        port = server.get_port()
        screen = look(f"http://127.0.0.1:{port}/?token={TOKEN}", server)
        screen.wait(lambda: spot(screen.shot(), "red")[0] > 100, "the page")
    screen.wait(lambda: screen.tab.get_by_text("Connecting...").count() == 1, "word that the server is gone")
    # The last picture stays.
    before = spot(screen.shot(), "red")
    assert before[0] > 100
    fake.show(positions=fake.snapshot.positions[::-1].copy())  # the bodies exchange their positions
    with served(port, fake) as server:
        assert server.get_port() == port
        screen.wait(lambda: spot(screen.shot(), "red")[1][0] > before[1][0] + 50, "the new state in the picture")
        screen.close()
    assert [error for error in screen.errors if "WebSocket" not in error] == []
