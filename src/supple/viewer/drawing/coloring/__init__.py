"""Fields and color scales."""
