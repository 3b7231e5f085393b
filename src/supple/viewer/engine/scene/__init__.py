"""The scene of the live page and its changes."""
