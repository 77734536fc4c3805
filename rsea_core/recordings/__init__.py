"""Recordings of a machine: reading, quality and consistency checks."""
