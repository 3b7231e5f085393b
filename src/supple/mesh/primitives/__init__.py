"""How the ready-made shapes are built."""
