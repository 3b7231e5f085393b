"""`supple.obstacles`: rigid things that bodies collide with. (`supple.shapes` has meshes of bodies.)"""

from supple.runtime.public_names import public_names

__getattr__, __all__ = public_names(__name__)


def __dir__() -> list[str]:
    return __all__
