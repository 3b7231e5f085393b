"""What tests of loads share."""

import numpy as np

from supple.solvers.implicit.energies.potential import HessianBlocks


def derivative_errors(potential, tet_count, x, d, steps):
    """Relative errors of gradient and Hessian along d against differences, for each step; and the Hessian times d."""

    def gradient(at):
        out = np.zeros_like(at)
        potential.add_gradient(at, out)
        return out

    blocks, product = HessianBlocks.zeros(tet_count, len(x)), np.zeros_like(x)
    potential.add_hessian(x, blocks, False)
    for part in (*blocks.beyond_elements, *blocks.low_rank):
        part.add_product(d, product)
    slope, errors = float((gradient(x) * d).sum()), []
    for h in steps:
        by_value = (potential.value(x + h * d) - potential.value(x - h * d)) / (2 * h)
        by_force = (gradient(x + h * d) - gradient(x - h * d)) / (2 * h)
        errors.append((abs(by_value - slope) / abs(slope), np.abs(by_force - product).max() / np.abs(product).max()))
    return errors, product
