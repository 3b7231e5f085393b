"""Numbering, coloring and compilation of Gauss-Seidel sweeps."""
