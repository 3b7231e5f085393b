"""Reading and writing files: whole files or none, and groups of files."""
