"""Numbers of twice the precision as sums of two floats (high, low), for kernels: about 32 decimal digits.

Sources: Dekker (1971); Knuth, "The Art of Computer Programming", volume 2, section 4.2.2; Hida, Li, Bailey, "Library
for Double-Double and Quad-Double Arithmetic" (2007).
"""

from supple.runtime.kernel_cache import njit


@njit(forceinline=False)
def sum_error(x, y, total):
    """x + y - total, exactly, for total = x + y rounded."""
    z = total - x
    return (x - (total - z)) + (y - z)


@njit(forceinline=False)
def product_error(x, y, product):
    """x y - product, exactly, for product = x y rounded."""
    p = 134217729.0 * x
    x_high = p - (p - x)
    x_low = x - x_high
    q = 134217729.0 * y
    y_high = q - (q - y)
    y_low = y - y_high
    return x_low * y_low - (((product - x_high * y_high) - x_low * y_high) - x_high * y_low)


@njit(forceinline=False)
def two_sum(x, y):
    """x + y of two floats, exactly."""
    total = x + y
    return total, sum_error(x, y, total)


@njit(forceinline=False)
def two_product(x, y):
    """x y of two floats, exactly."""
    product = x * y
    return product, product_error(x, y, product)


@njit(forceinline=False)
def difference(x, y):
    """x - y of two floats, exactly."""
    return two_sum(x, -y)


@njit(forceinline=False)
def add(a, b):
    high, low = two_sum(a[0], b[0])
    tail, tail_low = two_sum(a[1], b[1])
    low += tail
    total = high + low
    low = (low - (total - high)) + tail_low
    high = total + low
    return (high, low - (high - total))


@njit(forceinline=False)
def subtract(a, b):
    return add(a, (-b[0], -b[1]))


@njit(forceinline=False)
def multiply(a, b):
    product, error = two_product(a[0], b[0])
    low = error + (a[0] * b[1] + a[1] * b[0])
    total = product + low
    return (total, low - (total - product))


@njit(forceinline=False)
def triple_product(a, b, c):
    """(a x b) . c of vectors of double-double numbers."""
    x = multiply(subtract(multiply(a[1], b[2]), multiply(a[2], b[1])), c[0])
    y = multiply(subtract(multiply(a[2], b[0]), multiply(a[0], b[2])), c[1])
    z = multiply(subtract(multiply(a[0], b[1]), multiply(a[1], b[0])), c[2])
    return add(add(x, y), z)
