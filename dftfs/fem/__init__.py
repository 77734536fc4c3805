"""A finite-strain finite-element engine. It knows no springs: meshes, numbers, names in; fields out."""
