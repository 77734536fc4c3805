"""A slow torque that is small beside the usual one is no evidence of missing physics."""

from types import SimpleNamespace

import numpy as np
import pytest

from rsea_core.identify.multistep.criteria import UNKNOWN_MOST, UNKNOWN_SHARE
from rsea_core.identify.window_fit import leaves_much_torque, leaves_some_torque


def estimator(fast: float, slow: float, usual: float = 10.0):
    """An estimator with unknown torques of these shares of the usual one."""
    noise = SimpleNamespace(inputs=np.array([fast * usual, 0.0, 7.0, slow * usual, 9.0]))
    track = SimpleNamespace(
        noise=noise, scale=SimpleNamespace(torque_Nm=np.array([usual, 0.5 * usual]), time_s=1.0)
    )
    return SimpleNamespace(
        tracks=[track], problem=SimpleNamespace(timing=SimpleNamespace(smooth=False))
    )


@pytest.mark.parametrize(
    ("fast", "slow", "some"),
    [(0.0, 0.5, False), (0.0, 2.0, True), (2.0, 0.0, True), (0.8, 0.8, True)],
)
def test_fast_and_slow_unknown_torques_count_together(fast, slow, some):
    own = estimator(fast * UNKNOWN_SHARE, slow * UNKNOWN_SHARE)
    assert leaves_some_torque(own) == some


def test_a_slow_torque_alone_is_not_much():
    """A drift of the amplifier is no physics of the machine, however large."""
    assert not leaves_much_torque(estimator(0.0, 2.0 * UNKNOWN_MOST))
    assert leaves_much_torque(estimator(2.0 * UNKNOWN_MOST, 0.0))
