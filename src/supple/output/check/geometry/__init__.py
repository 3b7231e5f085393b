"""Exact and floating-point geometry of the checks; independent of the solvers."""
