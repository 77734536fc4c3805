"""Torque over angle by finite elements, with contact."""
