"""What crosses the boundary between the page's process and the simulation's process."""
