"""Diagnosis of a spring's bench: loops of torque over angle."""
