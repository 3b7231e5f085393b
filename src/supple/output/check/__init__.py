"""Verification of recordings: whether what is in them can be true, found out without the code that made them.

Nothing here imports a solver, its step filter, its root finder or its contact library: geometric questions are
answered by predicates of our own whose signs are exact.
"""
