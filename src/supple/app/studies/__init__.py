"""`supple.studies`: what a sweep varies, how its cases are chosen, and the table of what they measured."""

from supple.runtime.public_names import public_names

__getattr__, __all__ = public_names(__name__)


def __dir__() -> list[str]:
    return __all__
