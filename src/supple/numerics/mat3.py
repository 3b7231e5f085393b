"""3-vectors and 3x3 matrices as tuples, for use inside kernels: no memory is allocated, values stay in registers.

A vector is (x, y, z). A matrix is nine numbers, row after row: M = (m00, m01, m02, m10, m11, m12, m20, m21, m22).
"""

from supple.runtime.kernel_cache import njit


@njit
def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit
def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@njit
def subtract(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@njit
def row(x, i):
    """Row i of an (n, 3) array, as a vector."""
    return (x[i, 0], x[i, 1], x[i, 2])


@njit
def det(M):
    return M[0] * (M[4] * M[8] - M[5] * M[7]) - M[1] * (M[3] * M[8] - M[5] * M[6]) + M[2] * (M[3] * M[7] - M[4] * M[6])


@njit
def mat_mul(A, B):
    """A B"""
    return (
        A[0] * B[0] + A[1] * B[3] + A[2] * B[6],
        A[0] * B[1] + A[1] * B[4] + A[2] * B[7],
        A[0] * B[2] + A[1] * B[5] + A[2] * B[8],
        A[3] * B[0] + A[4] * B[3] + A[5] * B[6],
        A[3] * B[1] + A[4] * B[4] + A[5] * B[7],
        A[3] * B[2] + A[4] * B[5] + A[5] * B[8],
        A[6] * B[0] + A[7] * B[3] + A[8] * B[6],
        A[6] * B[1] + A[7] * B[4] + A[8] * B[7],
        A[6] * B[2] + A[7] * B[5] + A[8] * B[8],
    )


@njit
def transpose(M):
    return (M[0], M[3], M[6], M[1], M[4], M[7], M[2], M[5], M[8])


@njit
def mat_mul_transposed(A, B):
    """A B^T"""
    return mat_mul(A, transpose(B))


@njit
def load_mat(array, e):
    """Matrix e of an (m, 3, 3) array."""
    return _row(array, e, 0) + _row(array, e, 1) + _row(array, e, 2)


@njit
def _row(array, e, i):
    return (array[e, i, 0], array[e, i, 1], array[e, i, 2])


@njit
def store_mat(M, array, e):
    """Write M as matrix e of an (m, 3, 3) array."""
    for i in range(3):
        for j in range(3):
            array[e, i, j] = M[3 * i + j]


@njit
def symmetric_eigen(a00, a11, a22, a12, a02, a01):
    """Eigenvalues and eigenvectors of a symmetric 3x3 matrix by cyclic Jacobi rotations.

    Returns
    -------
    w : the three eigenvalues, in no particular order.
    Q : orthogonal matrix (nine numbers); its column k belongs to w[k].

    Source: Golub, Van Loan, "Matrix Computations", section 8.5.
    """
    x0, x1, x2 = 1.0, 0.0, 0.0
    y0, y1, y2 = 0.0, 1.0, 0.0
    z0, z1, z2 = 0.0, 0.0, 1.0
    for _ in range(30):
        off = abs(a01) + abs(a02) + abs(a12)
        if not off > 1e-17 * (abs(a00) + abs(a11) + abs(a22)):
            break
        if a01 != 0.0:
            c, s, t = jacobi_rotation(a00, a11, a01)
            a00 -= t * a01
            a11 += t * a01
            a01 = 0.0
            a02, a12 = c * a02 - s * a12, s * a02 + c * a12
            x0, y0 = c * x0 - s * y0, s * x0 + c * y0
            x1, y1 = c * x1 - s * y1, s * x1 + c * y1
            x2, y2 = c * x2 - s * y2, s * x2 + c * y2
        if a02 != 0.0:
            c, s, t = jacobi_rotation(a00, a22, a02)
            a00 -= t * a02
            a22 += t * a02
            a02 = 0.0
            a01, a12 = c * a01 - s * a12, s * a01 + c * a12
            x0, z0 = c * x0 - s * z0, s * x0 + c * z0
            x1, z1 = c * x1 - s * z1, s * x1 + c * z1
            x2, z2 = c * x2 - s * z2, s * x2 + c * z2
        if a12 != 0.0:
            c, s, t = jacobi_rotation(a11, a22, a12)
            a11 -= t * a12
            a22 += t * a12
            a12 = 0.0
            a01, a02 = c * a01 - s * a02, s * a01 + c * a02
            y0, z0 = c * y0 - s * z0, s * y0 + c * z0
            y1, z1 = c * y1 - s * z1, s * y1 + c * z1
            y2, z2 = c * y2 - s * z2, s * y2 + c * z2
    return (a00, a11, a22), (x0, y0, z0, x1, y1, z1, x2, y2, z2)


@njit
def jacobi_rotation(app, aqq, apq):
    """Cosine, sine and tangent of the smaller rotation that makes entry (p, q) of a symmetric matrix vanish."""
    d = aqq - app
    h = 2.0 * apq
    r = abs(d) + (d * d + h * h) ** 0.5
    t = h / r if r > 0.0 else 1.0
    if d < 0.0:
        t = -t
    c = 1.0 / (1.0 + t * t) ** 0.5
    return c, t * c, t


@njit
def copy_elements(source, target):
    """Copy an array into one of the same shape, both of them contiguous.

    Numba takes up to two seconds to compile `target[:] = source`, for the text of the error where shapes differ.
    """
    to, given = target.reshape(-1), source.reshape(-1)
    for k in range(len(to)):
        to[k] = given[k]
