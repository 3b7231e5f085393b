"""Sparse symmetric matrices of 3x3 blocks, and linear solvers on them."""
