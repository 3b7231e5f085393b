"""Intersections at the start, and moving bodies apart."""
