"""Gradients and Hessians of potentials, and their differences from central differences along a direction."""

import numpy as np

from supple.solvers.implicit.energies.potential import HessianBlocks


def gradient_of(potential, x):
    """(n, 3) [N]."""
    out = np.zeros_like(x)
    potential.add_gradient(x, out)
    return out


def hessian_product(potential, tets, x, d, project=False):
    """All parts of the Hessian times d (n, 3) [N]."""
    blocks = HessianBlocks.zeros(len(tets), len(x))
    potential.add_hessian(x, blocks, project)
    out = np.einsum("nij,nj->ni", blocks.vertices, d)
    np.add.at(out, tets, np.einsum("eij,ej->ei", blocks.tets, d[tets].reshape(-1, 12)).reshape(-1, 4, 3))
    for part in (*blocks.beyond_elements, *blocks.low_rank, *blocks.corrections):
        part.add_product(d, out)
    return out


def differences(potential, x, d, step):
    """Central differences along d, of the value and of the gradient (n, 3)."""
    ahead, behind = x + step * d, x - step * d
    of_value = (potential.value(ahead) - potential.value(behind)) / (2 * step)
    return of_value, (gradient_of(potential, ahead) - gradient_of(potential, behind)) / (2 * step)


def assert_slope_two(exact, central, largest, within=0.1):
    """Errors of central(step) fall with the square of the step, from `largest` on, until they are round-off."""
    steps = largest * 0.5 ** np.arange(5)
    errors = np.array([np.abs(central(step) - exact).max() for step in steps])
    size = np.abs(exact).max()
    if errors.max() <= 1e-9 * size:
        return  # a polynomial of degree two: differences are exact
    if errors.min() < 1e-8 * size:
        assert errors.min() < errors.max() / 4
        return
    # The error at the shortest step may be round-off.
    assert abs(np.polyfit(np.log(steps[:4]), np.log(errors[:4]), 1)[0] - 2.0) < within


def assert_derivatives(potential, product, x, d, largest, within=0.1):
    """Gradient and Hessian of a potential along d, whose product with the Hessian is given, have slope two."""
    slope = np.vdot(gradient_of(potential, x), d)
    assert_slope_two(slope, lambda step: differences(potential, x, d, step)[0], largest, within)
    assert_slope_two(
        product, lambda step: differences(potential, x, d, step)[1].reshape(product.shape), largest, within
    )


def derivative_errors(potential, tets, x, d, steps):
    """Relative errors of gradient and Hessian along d for each step, (k, 2); and the Hessian times d."""
    slope, product = np.vdot(gradient_of(potential, x), d), hessian_product(potential, tets, x, d)
    errors = []
    for step in steps:
        of_value, of_gradient = differences(potential, x, d, step)
        errors.append((abs(of_value - slope) / abs(slope), np.abs(of_gradient - product).max() / np.abs(product).max()))
    return errors, product


def dense_couplings(parts, n):
    """The sum of matrices between vertices, each of which is stored once, (3n, 3n)."""
    out = np.zeros((n, 3, n, 3))
    for part in parts:
        for i, j, block in zip(part.rows, part.columns, part.blocks, strict=True):
            out[i, :, j] += block
            if i != j:
                out[j, :, i] += block.T
    return out.reshape(3 * n, 3 * n)
