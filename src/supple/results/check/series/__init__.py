"""Series of other programs as the checks see them."""
