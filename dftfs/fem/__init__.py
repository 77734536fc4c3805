"""A finite-strain engine. It knows no springs: meshes, numbers, names in; fields out."""
