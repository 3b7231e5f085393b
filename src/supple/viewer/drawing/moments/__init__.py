"""One moment of a simulation or of a recording, as the drawing code sees it."""
