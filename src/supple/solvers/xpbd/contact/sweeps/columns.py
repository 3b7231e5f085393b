"""Vectors in a line of numbers."""

from supple.runtime.kernel_cache import njit


@njit
def three(numbers, c):
    """The vector that begins at column c."""
    return (numbers[c], numbers[c + 1], numbers[c + 2])


@njit
def set_three(numbers, c, v):
    numbers[c], numbers[c + 1], numbers[c + 2] = v[0], v[1], v[2]
