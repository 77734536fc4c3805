"""Diagnosis of a steady map: torque over speed."""
