"""The hypotheses of a diagnosis: effects, their starts and parameters."""
