"""What tests of controls share."""

import pytest


@pytest.fixture
def received(fake, until):
    """Returns the next command."""

    def next_command():
        until(lambda: fake.received, what="a command")
        return fake.received.pop(0)

    return next_command
