"""One file per kind of entry of a scene file."""
