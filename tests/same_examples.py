"""The examples that hypothesis draws."""

from hypothesis import settings
from hypothesis.internal.conjecture import providers

# `make test` draws the same examples each time; `make fuzz` draws those of a seed (`--hypothesis-seed`).
settings.register_profile("same", derandomize=True, deadline=None)
settings.register_profile("new", derandomize=False, database=None, deadline=None)  # it is True where CI is set
settings.load_profile("same")
# Otherwise examples contain constants of all modules that were imported until then, which depends on the tests before.
providers._get_local_constants = providers.Constants
