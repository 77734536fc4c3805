"""Scenario and comparison files."""
