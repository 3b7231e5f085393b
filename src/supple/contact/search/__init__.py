"""Which points and triangles are near each other."""
