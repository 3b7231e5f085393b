"""Meshes: surfaces, tetrahedra, shapes, files, TetGen, skinning."""

import lazy_loader

# `supple.shapes` is this package's module.
__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, submodules=["shapes"])
