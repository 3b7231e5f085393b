"""Abaqus's input files (.inp)."""
