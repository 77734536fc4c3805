"""Which hypotheses explain the recordings: screening, search, refinement."""
