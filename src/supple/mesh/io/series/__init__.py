"""Series of meshes, one for each frame, as other programs write them."""
