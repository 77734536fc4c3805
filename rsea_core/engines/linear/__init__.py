"""Matrices of a model at an operating point."""
