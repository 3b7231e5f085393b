"""One file per mesh file format. Readers take the bytes of a file and give `CellSoup`; writers give bytes."""
