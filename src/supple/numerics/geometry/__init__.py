"""Predicates and queries on points and triangles."""
