"""Processes, clusters and the store of results."""
