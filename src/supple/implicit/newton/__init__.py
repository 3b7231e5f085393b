"""Projected Newton: objective, direction, step, convergence."""
