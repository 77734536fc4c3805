"""Margins and limit cycles of closed loops."""
