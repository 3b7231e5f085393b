"""One file per energy: value, gradient, Hessian."""
