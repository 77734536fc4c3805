"""Tuning and comparison of controllers."""
