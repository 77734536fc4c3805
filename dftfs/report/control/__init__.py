"""Pages of simulations and comparisons."""
