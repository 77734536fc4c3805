"""The thesis' numbers of its spring, printed against recomputed."""
