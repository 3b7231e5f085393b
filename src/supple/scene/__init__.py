"""What a user describes: bodies, obstacles, pins, loads, joints, stitches, actuators, sensors, and their scene."""

import lazy_loader

# `supple.obstacles` is this package's package.
__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, submodules=["obstacles"])
