"""Friction laws compared on held-out recordings."""
