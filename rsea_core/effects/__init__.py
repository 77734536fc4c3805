"""The physics that a rig file does not state; one file an effect."""
