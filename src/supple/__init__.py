"""Supple: tetrahedral soft bodies. A surface mesh goes in; a simulation that can be trusted comes out.

Everything public is here: `import supple as sp`. The names are listed in `__init__.pyi`. A name's module is imported
when the name is first used, so that the import of `supple` is quick.
"""

import copyreg
import sys
from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from typing import Any

import lazy_loader

from .runtime.displayed import supply

__version__ = "0.1.0"
_listed, _, __all__ = lazy_loader.attach_stub(__name__, __file__)
__all__ += ["__version__"]
_OBSTACLES = ("Box", "Capsule", "Cylinder", "Sphere", "TriangleObstacle")
supply(
    compilation="supple.results.progress:show_compilation",
    check="supple.results.check.checker:check_recording",
    export="supple.results.export.exporter:export",
    player="supple.results.player:player_of",
    plot="supple.results.plots:plot",
    progress="supple.results.progress:ProgressBar",
)


def _by_name(module: ModuleType) -> tuple[Callable[[str], ModuleType], tuple[str]]:
    return import_module, (module.__name__,)


# A function that says `sp.Scene` refers to this module, which is of a class of lazy_loader's. It is sent to other
# processes by its name, as all other modules are.
copyreg.pickle(type(sys.modules[__name__]), _by_name)  # pyright: ignore[reportArgumentType]


def __getattr__(name: str) -> Any:
    # `sp.Box` is short for `sp.obstacles.Box`. It is not listed, because a box can also be a body: `sp.shapes.box`.
    if name in _OBSTACLES:
        return getattr(_listed("obstacles"), name)
    if name in __all__ or name.startswith("__"):
        return _listed(name)
    from .kinds.suggestion import suggestion

    raise AttributeError(f"supple has no name {name!r}; {suggestion(name, [*__all__, *_OBSTACLES])}", name=name)


def __dir__() -> list[str]:
    return __all__
