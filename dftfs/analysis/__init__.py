"""Where geometry meets the engine: meshing, the torsion problem, checks, the link to rsea_core."""
