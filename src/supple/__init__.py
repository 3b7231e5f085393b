"""Supple: tetrahedral soft bodies. A surface mesh goes in; a simulation that can be trusted comes out.

Everything public is here: `import supple as sp`. The names are listed in `__init__.pyi`. A name's module is imported
when the name is first used, so that the import of `supple` is quick.
"""

import lazy_loader

from .runtime.displayed import supply

__version__ = "0.1.0"
__getattr__, _, __all__ = lazy_loader.attach_stub(__name__, __file__)
__all__ += ["__version__"]
supply(player="supple.results.player:player_of", progress="supple.results.progress:ProgressBar")


def __dir__() -> list[str]:
    return __all__
