"""Shape optimisation of the arms over the rod model, confirmed by finite elements."""
