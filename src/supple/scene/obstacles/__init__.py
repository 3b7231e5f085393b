"""`supple.obstacles`: rigid things that bodies collide with. (`supple.shapes` has meshes of bodies.)"""

import lazy_loader

__getattr__, _, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __dir__() -> list[str]:
    return __all__
