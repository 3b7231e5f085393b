"""The three-dimensional picture."""
