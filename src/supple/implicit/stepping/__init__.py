"""One step of time: integrators, substeps, pinned and scripted vertices."""
