"""From a surface to a tet mesh: TetGen, fTetWild and MeshFix in a child process."""
