"""What users call: the shell, the viewer, studies, runs, learning, demos."""

import lazy_loader

# `supple.studies` is this package's package.
__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, submodules=["studies"])
