"""What users call: the shell, the viewer, studies, runs, learning, demos."""
