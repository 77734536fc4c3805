"""Identification: what recordings say of a machine."""
