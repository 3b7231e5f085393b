"""Supple: tetrahedral soft bodies. A surface mesh goes in; a simulation that can be trusted comes out.

Everything public is here: `import supple as sp`. The names are listed in `__init__.pyi`. A name's module is imported
when the name is first used, so that the import of `supple` is quick.
"""

from typing import Any

from .runtime.displayed import supply
from .runtime.public_names import public_names

__version__ = "0.1.0"
_listed, __all__ = public_names(__name__)
__all__ += ["__version__"]
_OBSTACLES = ("Box", "Capsule", "Cylinder", "Sphere", "TriangleObstacle")
supply(
    compilation="supple.results.progress:show_compilation",
    check="supple.results.check.checker:check_recording",
    export="supple.results.export.exporter:export",
    player="supple.results.page.player:player_of",
    plot="supple.results.plots:plot",
    progress="supple.results.progress:ProgressBar",
    save_scene="supple.app.scene_file.writer:save_scene",
)


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
