"""Yield, fatigue and friction of a spring."""
