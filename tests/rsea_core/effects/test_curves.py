"""The curves that reports draw are the engine's laws, point by point."""

import numpy as np
import pytest

import rsea_core.effects.layout as e
from rsea_core.effects.hooks import summed
from rsea_core.effects.registry import LAWS
from rsea_core.effects.variant import TrialMachine
from rsea_core.identify.result import curve_arrays
from rsea_core.machine.plant import Plant

SPEEDS = np.array([-3.0, -0.2, 0.0, 0.1, 4.0])


def numbers(**values: float) -> np.ndarray:
    fx = np.zeros(e.N_EFFECTS)
    for name, value in values.items():
        fx[getattr(e, name)] = value
    return fx


def drawn(effect: str, fx: np.ndarray, x: np.ndarray, law: str | None = None, **plant: float):
    """The curve (n,) of an effect on a machine without friction, gravity or damping of its own."""
    kinds = LAWS[effect]
    kind = kinds[law] if law else next(iter(kinds.values()))
    numbers = np.array([plant.get(name, 0.0) for name in Plant._fields])
    trial = TrialMachine(plant=numbers, fx=fx, stiffness=12.0)
    return kind.curve.evaluate(trial, {}, x)


def test_dry_friction_is_its_level_against_the_motion_and_none_at_rest():
    fx = numbers(GEAR_FORWARD=0.3, GEAR_BACKWARD=0.5)
    np.testing.assert_array_equal(drawn("gear-friction", fx, SPEEDS), [-0.5, -0.5, 0, 0.3, 0.3])
    fx = numbers(LOAD_COULOMB=0.2)
    np.testing.assert_array_equal(drawn("load-friction", fx, SPEEDS), [-0.2, -0.2, 0, 0.2, 0.2])


def test_smooth_laws_are_the_effects_own():
    fx = numbers(GEAR_FORWARD=0.1, GEAR_BACKWARD=0.1, ATAN_LEVEL=0.2, ATAN_VELOCITY=0.5)
    found = drawn("gear-friction", fx, SPEEDS)
    expected = 0.1 * np.sign(SPEEDS) + 0.2 * np.arctan(SPEEDS / 0.5)
    np.testing.assert_allclose(found, expected, rtol=1e-14)
    fx = numbers(COGGING=0.2, COGGING_CYCLES=7.0, COGGING_PHASE=0.3)
    found = drawn("motor-cogging", fx, SPEEDS)
    np.testing.assert_allclose(found, -0.2 * np.sin(7.0 * SPEEDS + 0.3), rtol=1e-14)
    fx = numbers(DRAG=0.4, PARALLEL=2.0, PARALLEL_REST=0.1)
    drag = 0.4 * SPEEDS * np.abs(SPEEDS)
    np.testing.assert_allclose(drawn("load-drag", fx, SPEEDS), drag, rtol=1e-14)
    found = drawn("spring-parallel", fx, 2.0 * SPEEDS)
    np.testing.assert_allclose(found, -2.0 * (2.0 * SPEEDS - 0.1), rtol=1e-14)
    torque, found_drag = np.array([e.load_torque(fx, 2.0 * w, w, 0.0) for w in SPEEDS]).T
    np.testing.assert_allclose(found_drag, drag, rtol=1e-14)
    np.testing.assert_allclose(torque, found - drag, rtol=1e-14)
    total = summed("load_torque", fx, 2.0 * SPEEDS, SPEEDS)
    np.testing.assert_allclose(total, found, rtol=1e-14)


def test_a_dead_zone_and_a_linear_spring_are_straight_lines():
    fx = numbers(DEAD_ZONE=0.15)
    expected = np.sign(SPEEDS) * np.maximum(np.abs(SPEEDS) - 0.15, 0.0)
    np.testing.assert_allclose(drawn("drive-dead-zone", fx, SPEEDS), expected, atol=1e-15)
    found = drawn("spring-hardening", fx, SPEEDS)
    np.testing.assert_allclose(found, 12.0 * SPEEDS, rtol=1e-14)


def test_the_rising_branch_begins_fully_slipped_backwards_and_ends_forwards():
    """A stop of stiffness k that yields at y: -k y after the turn, k y once 2 y are passed."""
    fx = numbers(SLIP_STIFFNESS=5.0, SLIP_YIELD=0.1)
    bends = np.linspace(-1.0, 1.0, 201)
    found = curve_arrays.ascending(fx, bends)
    expected = 5.0 * np.clip(bends - bends[0] - 0.1, -0.1, 0.1)
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert found[0] == pytest.approx(-0.5)


def test_a_contact_that_hardens_follows_its_power_law():
    fx = numbers(EXPONENT=1.5, DEPTH=0.2)
    found = drawn("contact-nonlinear", fx, np.array([-0.1, 0.0, 0.05, 0.2]), contact_stiffness=30.0)
    np.testing.assert_allclose(found, [0.0, 0.0, 30.0 * 0.2 * 0.25**1.5, 6.0], rtol=1e-14)
