"""The simulation's side of the live page: the only part of the viewer that knows solvers."""
