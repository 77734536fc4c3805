"""Grids and lists of designs."""
