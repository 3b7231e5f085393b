"""Meshes: surfaces, tetrahedra, shapes, files, TetGen, skinning."""
