"""What the layers draw with."""
