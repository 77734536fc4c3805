"""Meshes of a spring."""
