"""Concealed cases of any one-axis machine: drawn over decades, simulated, logged with dirt, sealed.

Nothing here is shared with `rsea_core`: constants, laws, integrator and logging are written anew.
"""
