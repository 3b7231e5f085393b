"""Scene files: a YAML text that describes a scene, the solver and the timing of a run."""
