"""Identification by predictions over windows, on any one-axis machine."""
