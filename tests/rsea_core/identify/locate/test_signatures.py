"""Each cause leaves its own signature in port torques, and noise leaves none."""

import numpy as np
import pytest

from rsea_core.identify.locate.mismatch_map import since_reversal
from rsea_core.identify.locate.signatures import signatures
from rsea_core.identify.smoothing.quasi_static_ports import PortTorques
from rsea_core.recordings.recording import Recording

TIME = np.arange(8000) * 2e-3


def motion(seed=0):
    """A motion of many amplitudes and two rates: wheel, load, spring torque."""
    envelope = 0.3 + 0.7 * np.abs(np.sin(0.21 * TIME))
    phase = 2 * np.pi * np.where(TIME < 8.0, 0.5 * TIME, 2.0 * (TIME - 8.0) + 4.0)
    wheel = envelope * np.sin(phase)
    load = 0.8 * envelope * np.sin(phase - 0.35)
    return wheel, load


def made(port, torque, noise=0.01):
    """Recording and port torques of one port."""
    wheel, load = motion()
    rng = np.random.default_rng(1)
    speeds = np.gradient(wheel, TIME), np.gradient(load, TIME)
    signals = {
        "wheel_angle_rad": wheel,
        "wheel_velocity_rad_per_s": speeds[0],
        "load_angle_rad": load,
        "load_velocity_rad_per_s": speeds[1],
        "spring_deflection_rad": wheel - load,
        "torque_Nm": 65.0 * (wheel - load),
        "current_A": 0.2 * speeds[0] + 0.5 * wheel,
    }
    value = torque(signals) + noise * rng.standard_normal(TIME.size)
    recording = Recording(
        file="made.csv",
        columns={"time_s": TIME, "duty": 0.1 * wheel, "motor_angle_rad": 60.0 * wheel},
        sample_time_s=2e-3,
    )
    found = PortTorques(
        time_s=TIME, signals=signals, signals_std={}, ports={port: value},
        ports_std={port: np.full(TIME.size, noise)},
    )  # fmt: skip
    return [recording], [found]


def by_name(found):
    return {s.name: s for s in found}


@pytest.mark.parametrize(
    ("port", "mover", "speed"),
    [("G", "wheel", "wheel_velocity_rad_per_s"), ("L", "load", "load_velocity_rad_per_s")],
)
def test_dry_friction_steps_at_the_reversals_of_its_own_joint(port, mover, speed):
    found = by_name(signatures(*made(port, lambda s: -0.5 * np.sign(s[speed]))))
    step = found["reversal step"]
    assert step.value == pytest.approx(-1.0, abs=0.1)
    assert f"where the {mover} turns back" in step.sentence
    assert "against the motion" in step.sentence
    assert found["odd in speed"].value == pytest.approx(-0.5, abs=0.02)
    assert found["loop energy"].value == pytest.approx(1.0, abs=0.15)
    assert found["loop energy"].details["rate_power"] == pytest.approx(0.0, abs=0.15)
    assert "dry friction" in found["loop energy"].sentence


def test_viscous_loss_grows_with_amplitude_squared_and_rate():
    found = by_name(signatures(*made("G", lambda s: -0.3 * s["wheel_velocity_rad_per_s"])))
    loop = found["loop energy"]
    assert loop.value == pytest.approx(2.0, abs=0.25)
    assert loop.details["rate_power"] == pytest.approx(1.0, abs=0.2)
    assert "viscous" in loop.sentence


def test_friction_that_differs_by_direction_shows_an_even_part():
    found = by_name(
        signatures(*made("G", lambda s: -0.5 * np.sign(s["wheel_velocity_rad_per_s"]) - 0.1))
    )
    assert found["even in speed"].value == pytest.approx(-0.1, abs=0.03)


def test_cogging_is_found_at_its_order_and_size():
    found = by_name(
        signatures(*made("G", lambda s: 0.2 * np.sin(18.0 * 60.0 * s["wheel_angle_rad"])))
    )
    order = found["order of the motor"]
    assert order.details["order"] == 18.0
    assert order.value == pytest.approx(0.2, rel=0.15)


def test_load_dependent_friction_has_its_slope_in_each_power_flow():
    def torque(s):
        speed, load = s["wheel_velocity_rad_per_s"], s["torque_Nm"]
        slope = np.where(speed * load > 0.0, 0.08, 0.03)
        return -slope * np.abs(load) * np.sign(speed)

    found = by_name(signatures(*made("G", torque)))
    assert found["load slope driving"].value == pytest.approx(0.08, rel=0.1)
    assert found["load slope being driven"].value == pytest.approx(0.03, rel=0.2)


def test_a_spring_that_touches_shows_a_kink_at_its_onset():
    def torque(s):
        deflection = s["spring_deflection_rad"]
        return 30.0 * np.sign(deflection) * np.maximum(np.abs(deflection) - 0.25, 0.0)

    band = by_name(signatures(*made("S", torque)))["slope outside a band"]
    assert band.details["onset_rad"] == pytest.approx(0.25, abs=0.03)
    assert band.details["kink_over_cubic"] < 0.8
    assert "a kink fits better" in band.sentence


def test_a_hardening_spring_shows_smooth_growth():
    band = by_name(signatures(*made("S", lambda s: 40.0 * s["spring_deflection_rad"] ** 3)))[
        "slope outside a band"
    ]
    assert band.details["kink_over_cubic"] > 1.0


def test_a_heating_winding_shows_in_the_resistance_trend():
    found = by_name(signatures(*made("V", lambda s: -0.05 * TIME * s["current_A"])))
    assert found["resistance trend"].value == pytest.approx(0.05, rel=0.1)


def test_a_drifting_sensor_shows_a_trend():
    found = by_name(signatures(*made("S", lambda s: 0.02 * TIME)))
    assert found["trend with time"].value == pytest.approx(0.02, rel=0.05)


def test_noise_alone_has_no_signature():
    for port in "VGSL":
        assert signatures(*made(port, lambda s: np.zeros(TIME.size))) == ()


def test_time_since_the_last_reversal():
    speed = np.array([1.0, 1.0, 0.0, -1.0, -1.0, 0.0, -1.0, 1.0])
    time = np.arange(8.0)
    assert since_reversal(time, speed) == pytest.approx([0, 1, 2, 0, 1, 2, 3, 0])
