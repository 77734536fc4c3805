"""Simulations: inputs and references in, trajectories and their figures out."""
