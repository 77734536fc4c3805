"""Stiffness in six directions, frequencies, stability."""
