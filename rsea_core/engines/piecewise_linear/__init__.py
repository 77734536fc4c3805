"""Exact exponentials where a machine is linear between events."""
