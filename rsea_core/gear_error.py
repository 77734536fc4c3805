"""The transmission error of the gear as a function of the wheel's angle."""

import numpy as np
from numba import njit

import rsea_core.effects as e


@njit(error_model="numpy", inline="always")
def angle_error(fx, wheel, gear_ratio):
    """Transmission error [rad] at the wheel, zero at angle zero, and its slope over the angle."""
    seconds = fx[e.WHEEL_ERROR_2] != 0.0 or fx[e.WORM_ERROR_2] != 0.0 or fx[e.WORM_ERROR_3] != 0.0
    if fx[e.WHEEL_ERROR] == 0.0 and fx[e.WORM_ERROR] == 0.0 and not seconds:
        return 0.0, 0.0
    slow = wheel + fx[e.WHEEL_PHASE]
    fast = gear_ratio * wheel + fx[e.WORM_PHASE]
    error = fx[e.WHEEL_ERROR] * np.sin(slow) + fx[e.WORM_ERROR] * np.sin(fast)
    slope = fx[e.WHEEL_ERROR] * np.cos(slow) + gear_ratio * fx[e.WORM_ERROR] * np.cos(fast)
    if seconds:
        slow = 2.0 * wheel + fx[e.WHEEL_PHASE_2]
        fast = 2.0 * gear_ratio * wheel + fx[e.WORM_PHASE_2]
        error += fx[e.WHEEL_ERROR_2] * np.sin(slow) + fx[e.WORM_ERROR_2] * np.sin(fast)
        slope += 2.0 * fx[e.WHEEL_ERROR_2] * np.cos(slow)
        slope += 2.0 * gear_ratio * fx[e.WORM_ERROR_2] * np.cos(fast)
    if fx[e.WORM_ERROR_3] != 0.0:
        fast = 3.0 * gear_ratio * wheel + fx[e.WORM_PHASE_3]
        error += fx[e.WORM_ERROR_3] * np.sin(fast)
        slope += 3.0 * gear_ratio * fx[e.WORM_ERROR_3] * np.cos(fast)
    return error - fx[e.ERROR_AT_ZERO], slope


def array_angle_error(fx, wheel, gear_ratio):
    """Transmission error [rad] for an array of wheel angles."""
    return angle_error.py_func(fx, wheel, gear_ratio)[0] + np.zeros_like(wheel)
