"""States and unknown port torques by a Kalman smoother."""
