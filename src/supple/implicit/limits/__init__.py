"""What bounds a Newton step: no tetrahedron inverts, no surfaces touch."""
