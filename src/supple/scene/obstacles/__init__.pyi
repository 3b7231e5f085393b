"""The public names of `supple.obstacles` and their modules."""

from .box import Box as Box
from .capsule import Capsule as Capsule
from .cylinder import Cylinder as Cylinder
from .half_space import HalfSpace as HalfSpace
from .sphere import Sphere as Sphere
from .torus import Torus as Torus
from .triangle_obstacle import TriangleObstacle as TriangleObstacle
