"""`supple.studies`: what a sweep varies, how its cases are chosen, and the table and plots of what they measured."""

import lazy_loader

__getattr__, _, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __dir__() -> list[str]:
    return __all__
