"""Fits of a model to recordings by replays and whitened innovations."""
