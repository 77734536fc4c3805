"""Black boxes on the recordings of a case: what a diagnosis has to match in held-out error.

Each learns the port torques that the machine with re-estimated constants lacks (at the gear
output, in the spring, at the link), and predicts the hidden test by a free run
with those torques added.
"""
