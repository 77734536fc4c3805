"""Fuzzy inference and rule bases."""
