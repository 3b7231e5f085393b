"""Who gets in, and with what."""
