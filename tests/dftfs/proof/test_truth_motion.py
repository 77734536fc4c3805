"""The proof's integrator agrees with scipy, converges with its step and conserves energy."""

import itertools

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dftfs.proof.machine import Physics, Series
from tests.cases.proof import BARE, LOSSLESS, run

HOLD = 40  # samples that one level of the input lasts


def held_levels(seconds: float) -> np.ndarray:
    levels = np.random.default_rng(4).uniform(-0.3, 0.3, round(seconds / 1e-3 / HOLD))
    return np.repeat(levels, HOLD)


def scipy_motion(load: str, duty: np.ndarray) -> np.ndarray:
    """The contract's nominal equations by DOP853, level by level. Rows: i, w_m, x_m, w_l, x_l."""
    m = BARE
    n, weight = m.gear_ratio, 9.80665 * m.load_mass_kg * m.load_distance_m
    inertia = m.motor_inertia_kgm2 + m.output_inertia_kgm2 / n**2
    damping = m.motor_viscous_Nms_per_rad + m.output_viscous_Nms_per_rad / n**2

    def rate(_: float, y: np.ndarray, u: float) -> list[float]:
        i, wm, xm, wl, xl = y
        torque = m.spring_stiffness_Nm_per_rad * (xm / n - xl)
        pulse = torque - m.load_viscous_Nms_per_rad * wl - weight * np.sin(xl)
        if load == "contact" and xl > m.contact_angle_rad:
            pulse -= m.contact_stiffness_Nm_per_rad * (xl - m.contact_angle_rad)
            pulse -= m.contact_damping_Nms_per_rad * wl
        still = load == "locked"
        volts = u * m.supply_voltage_V - m.terminal_resistance_ohm * i
        return [
            (volts - m.back_emf_constant_Vs_per_rad * wm) / m.terminal_inductance_H,
            (m.torque_constant_Nm_per_A * i - damping * wm - torque / n) / inertia,
            wm,
            0.0 if still else pulse / m.load_inertia_kgm2,
            0.0 if still else wl,
        ]

    y, rows = np.zeros(5), []
    for k in range(0, duty.size, HOLD):
        times = 1e-3 * np.arange(HOLD + 1)
        got = solve_ivp(
            rate,
            (0.0, times[-1]),
            y,
            method="DOP853",
            t_eval=times,
            rtol=1e-10,
            atol=1e-12,
            max_step=1e-3,
            args=(duty[k],),
        )
        rows.append(got.y[:, :-1])
        y = got.y[:, -1]
    return np.concatenate(rows, axis=1)


@pytest.mark.parametrize("load", ["pendulum", "locked", "contact"])
def test_machine_without_effects_follows_scipy(load):
    duty = held_levels(2.0)
    reference = scipy_motion(load, duty)
    motion = run(BARE, load, duty).values
    assert np.abs(reference[2]).max() > 2.0  # something moves: 330 counts at least
    np.testing.assert_allclose(motion["motor_angle_rad"], reference[2], atol=2e-5)
    np.testing.assert_allclose(motion["load_angle_rad"], reference[4], atol=2e-6)
    np.testing.assert_allclose(motion["current_A"], reference[0], atol=1e-4)


def test_halving_the_step_quarters_the_error():
    duty = held_levels(1.0)
    reference = scipy_motion("pendulum", duty)[2]
    errors = [
        np.abs(run(BARE, "pendulum", duty, step_s=h).values["motor_angle_rad"] - reference).max()
        for h in (200e-6, 100e-6, 50e-6)
    ]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.1)


def energy(machine, motion, series: Series) -> np.ndarray:
    """Kinetic, elastic and gravity energy of a loss-free machine, rigid gear. Shape (samples,)."""
    v = motion.values
    gain = np.full(v["motor_angle_rad"].size, 1.0 / machine.gear_ratio)
    stored = np.zeros(gain.size)
    for a, n, phase in series.gear_error:
        gain += a * n * np.cos(n * v["motor_angle_rad"] + phase)
    for a, n, phase in series.cogging:
        stored -= a / n * np.cos(n * v["motor_angle_rad"] + phase)
    inertia = machine.motor_inertia_kgm2 + gain**2 * machine.output_inertia_kgm2
    weight = 9.80665 * machine.load_mass_kg * machine.load_distance_m
    return (
        stored
        + 0.5 * inertia * v["motor_velocity_rad_per_s"] ** 2
        + 0.5 * machine.load_inertia_kgm2 * v["load_velocity_rad_per_s"] ** 2
        + 0.5 * v["torque_Nm"] ** 2 / machine.spring_stiffness_Nm_per_rad
        + weight * (1.0 - np.cos(v["load_angle_rad"]))
    )


@pytest.mark.parametrize(
    "series",
    [
        Series(),
        Series(gear_error=np.array([[2e-3, 1.0, 0.3], [1e-3, 3.0, 1.0]])),
        Series(cogging=np.array([[0.02, 12.0, 0.5]])),
    ],
    ids=["bare", "gear error", "cogging"],
)
def test_energy_of_a_loss_free_machine_stays(series):
    motion = run(
        LOSSLESS, "pendulum", 0.0, series=series, by_current=True, load_angle_rad=0.15, seconds=2.0
    )
    total = energy(LOSSLESS, motion, series)
    assert np.ptp(motion.values["motor_angle_rad"]) > 0.1
    assert np.ptp(total) < 2e-3 * total.max()
    drift = abs(total[-200:].mean() - total[:200].mean())
    assert drift < 2e-5 * total.max()


@pytest.mark.parametrize(
    "physics",
    [
        Physics(
            gear_coulomb_plus_Nm=0.01,
            gear_coulomb_minus_Nm=0.01,
            gear_static_ratio=1.5,
            gear_bristle_rad=2e-3,
        ),
        Physics(worm_friction_rad=0.03),
        Physics(load_coulomb_Nm=0.05),
        Physics(loop_torque_Nm=0.3, loop_yield_rad=0.02),
        Physics(drag_coefficient=0.05),
    ],
    ids=["bristle", "worm", "joint", "loop", "drag"],
)
def test_a_dissipative_effect_only_takes_energy(physics):
    """Let go, no drive: the machine's own energy at the extremes of the swing falls."""
    motion = run(
        LOSSLESS,
        "pendulum",
        0.0,
        physics=physics,
        by_current=True,
        load_angle_rad=0.15,
        seconds=2.0,
    )
    total = energy(LOSSLESS, motion, Series())
    tops = [chunk.max() for chunk in np.array_split(total, 8)]
    assert tops[-1] < 0.999 * tops[0]
    assert all(b <= a * (1.0 + 2e-3) for a, b in itertools.pairwise(tops))


def test_a_step_of_20_us_is_converged_with_every_friction():
    physics = Physics(
        gear_coulomb_plus_Nm=0.03,
        gear_coulomb_minus_Nm=0.02,
        gear_static_ratio=1.4,
        gear_bristle_damping_Nms_per_rad=0.02,
        worm_friction_rad=0.05,
        load_coulomb_Nm=0.05,
        loop_torque_Nm=0.4,
    )
    duty = held_levels(1.0)
    coarse, fine = (
        run(BARE, "pendulum", duty, physics=physics, step_s=h).values for h in (20e-6, 5e-6)
    )
    count = 2 * np.pi / 8192
    assert np.abs(coarse["motor_angle_rad"] - fine["motor_angle_rad"]).max() < 0.02 * count
    assert np.abs(coarse["torque_Nm"] - fine["torque_Nm"]).max() < 1e-3
