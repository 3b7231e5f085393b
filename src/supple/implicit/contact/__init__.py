"""Incremental potential contact: barriers that keep surfaces apart, friction, and the bound on steps."""
