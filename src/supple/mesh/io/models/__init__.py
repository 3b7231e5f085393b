"""Files of whole models: parts with places, sets and materials, of which a mesh is read."""
