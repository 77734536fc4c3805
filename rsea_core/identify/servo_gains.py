"""Gains of a servo that its rig file leaves out: where a fit begins, and what it cannot separate.

A servo of gains k_p, k_d that turns an inertia J follows its goal u like

    y'' + 2 zeta omega y' + omega^2 y = omega^2 u(t - d), omega^2 = k_p / J, 2 zeta omega = k_d / J

so that a log of goals and angles shows omega and zeta, and no torque. The scale is that of the
inertia that the rig file states. Gains that it leaves out begin at the best omega, zeta and d of a
grid whose ends are times of the log, and are free from there: their prior is wide.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RecordingError
from rsea_core.machine.inputs import POSITION_COMMAND
from rsea_core.machine.rig import Rig
from rsea_core.recordings.case import Case
from rsea_core.recordings.finding import Finding, Kind
from rsea_core.recordings.recording import Recording

GAIN, DAMPING = "servo_proportional_Nm_per_rad", "servo_derivative_Nms_per_rad"
FREE = 1.0  # standard deviation of the logarithm of a gain that is not stated
RATES = np.geomspace(0.01, 2.0, 24)  # omega times the time between two rows
DAMPINGS = (0.1, 0.3, 0.7, 1.0, 1.5, 2.5, 4.0, 7.0)
DELAYS = (0, 1, 2, 3, 5, 8)  # rows
MOST_ROWS = 4000


def with_servo_gains(case: Case) -> tuple[Case, tuple[str, ...]]:
    """The case with a start for each gain that its rig file leaves out, and their names.

    Raises
    ------
    RecordingError
        If no inertia is stated, which sets the scale of the gains.
    """
    driven = [r for r in case.identification if r.command_name == POSITION_COMMAND]
    missing = tuple(key for key in (GAIN, DAMPING) if getattr(case.rig, key) is None)
    if not driven or not missing:
        return case, ()
    inertia = _inertia(case.rig)
    if not inertia > 0.0:
        raise RecordingError(
            f"{case.name}: gains of a servo that are not stated need an inertia in [rig]"
            " (load_inertia_kgm2, output_inertia_kgm2 or motor_inertia_kgm2): goals and angles"
            " show only their ratio"
        )
    omega, zeta = _best_follower(case.rig, driven, inertia)
    found = {GAIN: inertia * omega**2, DAMPING: 2.0 * zeta * omega * inertia}
    stated = dict(case.rig.tolerances)
    rig = replace(
        case.rig,
        **{key: found[key] for key in missing},
        tolerances=tuple((stated | dict.fromkeys(missing, FREE)).items()),
    )
    return replace(case, rig=rig), missing


def _inertia(rig: Rig) -> float:
    """All that turns with the output [kg m2]."""
    motor = (rig.motor_inertia_kgm2 or 0.0) * (rig.gear_ratio or 1.0) ** 2
    gear = motor + (rig.output_inertia_kgm2 or 0.0) if rig.has("gear") else 0.0
    return gear + ((rig.load_inertia_kgm2 or 0.0) if rig.has("load") else 0.0)


def _angle(rig: Rig, r: Recording) -> NDArray | None:
    """The angle at the output, as it was read."""
    if "load_angle_rad" in r:
        return r["load_angle_rad"]
    ratio = (rig.gear_ratio or 1.0) if rig.has("gear") else 1.0
    if "motor_angle_rad" in r:
        return r["motor_angle_rad"] / ratio
    for name, side in (("load_velocity_rad_per_s", 1.0), ("motor_velocity_rad_per_s", ratio)):
        if name in r:
            return np.cumsum(r[name]) * r.sample_time_s / side
    return None


def _best_follower(rig: Rig, driven: Sequence[Recording], inertia: float) -> tuple[float, float]:
    """omega and zeta of the grid that leave least of the angles, summed over recordings."""
    pairs = []
    for r in driven:
        angle = _angle(rig, r)
        if angle is not None:
            rows = slice(0, min(r.rows, MOST_ROWS))
            pairs.append((r[POSITION_COMMAND][rows], angle[rows], r.sample_time_s))
    row = min((row for *_, row in pairs), default=1.0)
    rates, gain, damping = RATES / row, getattr(rig, GAIN), getattr(rig, DAMPING)
    if gain is not None:
        rates = np.array([np.sqrt(gain / inertia)])
    best, least = (rates[len(rates) // 2], 1.0), np.inf
    for omega, zeta in product(rates, DAMPINGS):
        if damping is not None:
            zeta = damping / (2.0 * omega * inertia)
        left = np.zeros(len(DELAYS))
        for goal, angle, dt in pairs:
            left += _left(goal, angle, dt, omega, zeta)
        if left.min() < least:
            best, least = (float(omega), float(zeta)), float(left.min())
    return best


def _left(goal: NDArray, angle: NDArray, dt: float, omega: float, zeta: float) -> NDArray:
    """Mean squares of the angle, over its own, that a follower leaves at each of `DELAYS`."""
    from scipy.signal import cont2discrete, lfilter  # takes a second to import, rarely needed

    A = np.array([[0.0, 1.0], [-(omega**2), -2.0 * zeta * omega]])
    system = A, np.array([[0.0], [omega**2]]), np.array([[1.0, 0.0]]), np.zeros((1, 1))
    step, drive, *_ = cont2discrete(system, dt)
    denominator = [1.0, -np.trace(step), np.linalg.det(step)]
    numerator = [0.0, drive[0, 0], step[0, 1] * drive[1, 0] - step[1, 1] * drive[0, 0]]
    follows = lfilter(numerator, denominator, goal - goal[0])
    found = []
    for rows in DELAYS:
        late = np.concatenate([np.zeros(rows), follows[: follows.size - rows]])
        found.append(np.var(angle - late) / max(np.var(angle), 1e-300))
    return np.array(found)


def servo_findings(conclusion, filled: Sequence[str]) -> list[Finding]:
    """What goals and angles alone cannot separate, and the gains that were not stated."""
    case, values = conclusion.case, conclusion.nominal
    driven = [r for r in case.identification if r.command_name == POSITION_COMMAND]
    if not driven:
        return []
    rig, found = conclusion.rig(), []
    gain, damping = rig.servo_proportional_Nm_per_rad, rig.servo_derivative_Nms_per_rad or 0.0
    J = _inertia(rig)
    if filled:
        text = (
            f"{' and '.join(filled)} not stated, fitted: gain over inertia {gain / J:.4g} 1/s2,"
            f" damping over inertia {damping / J:.4g} 1/s; their scale is that of the rig's inertia"
            f" ({J:.4g} kg m2), and torques found here are in proportion to it"
        )
        found.append(Finding(kind=Kind.METHOD, text=text))
    if not any("torque_Nm" in r for r in driven) and not filled:
        text = (
            "no torque is logged: a servo's gains, the inertia and all torques are known only up"
            " to a common scale factor: that of the most certain of them in rig.toml"
        )
        found.append(Finding(kind=Kind.METHOD, text=text))
    viscous = [key for key in values if key.endswith("viscous_Nms_per_rad")]
    if viscous and rig.servo != "angle-and-rate":
        text = (
            f"{DAMPING} and {' and '.join(viscous)} act alike (the goal of the speed is zero): only"
            " their sum is identifiable"
        )
        found.append(Finding(kind=Kind.METHOD, text=text))
    return found
