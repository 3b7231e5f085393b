"""The floating-point transformations that sweeps permit."""

# No flag that assumes finite numbers (NaN must be detected) and none that reorders sums (same bits on any threads).
FLAGS = {"contract", "arcp", "nsz"}
