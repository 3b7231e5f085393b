"""One file per constraint set."""
