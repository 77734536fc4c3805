"""The true machine: constants and effects, integrator, recordings, sensors."""
