"""What the columns and the rig file of a recording make one expect of each of its readings.

An expectation comes from kinematics, the spring's stiffness or the winding's resistance alone; it
is compared with the reading after both are averaged over more than the resonances last, where no
missing physics turns a sign or makes a factor of four.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.machine.rig import Rig
from rsea_core.recordings.recording import Recording

SLOWEST_MODE_s = 0.1  # averages last as long where the rig file does not say how slow it swings
EMF_UNSURE = 0.03  # of the back-EMF: tolerances of its constant and of the supply
PERIODS = 2.0  # of the slowest resonance that an average lasts


@dataclass(frozen=True, kw_only=True)
class ExpectedReading:
    """A reading and what the rest of the recording expects of it.

    Attributes
    ----------
    name, source : str
        The column, and a phrase for where the expectation comes from.
    reading, expected : (n,) array
    floor : float
        Standard deviation of both together, unit of the reading.
    """

    name: str
    source: str
    reading: NDArray
    expected: NDArray
    floor: float


def expected_readings(rig: Rig, r: Recording, floors: dict[str, float]) -> list[ExpectedReading]:
    """What a rig file and the columns of a recording expect of each reading."""
    found = []
    output = gear_output_angle(rig, r, floors)
    read = "load_angle_rad" in r.responses
    if output is not None and read and r.load.kind in ("pendulum", "free", "constant-torque"):
        angle, floor = output
        both = float(np.hypot(floor, floors["load_angle_rad"]))
        found.append(_expected("load_angle_rad", "motor_angle_rad / gear_ratio", r, angle, both))
    deflected = deflection(r, output, floors)
    if deflected is not None and "spring_deflection_rad" in r.responses:
        both = float(np.hypot(deflected[1], floors["spring_deflection_rad"]))
        found.append(
            _expected("spring_deflection_rad", "the angles' difference", r, deflected[0], both)
        )
    stiffness = rig.spring_stiffness_Nm_per_rad
    if stiffness and rig.has("spring") and "torque_Nm" in r.responses:
        source = "the angles' difference"
        if deflected is None and "spring_deflection_rad" in r.responses:
            source = "spring_deflection_rad"
            deflected = r[source], floors[source]
        if deflected is not None:
            both = float(np.hypot(stiffness * deflected[1], floors["torque_Nm"]))
            phrase = f"spring_stiffness_Nm_per_rad times {source}"
            found.append(_expected("torque_Nm", phrase, r, stiffness * deflected[0], both))
    current = _winding_current(rig, r, floors) or _commanded_current(rig, r, floors)
    if current is not None:
        found.append(current)
    for side in ("motor", "load"):
        angle, speed = f"{side}_angle_rad", f"{side}_velocity_rad_per_s"
        if {angle, speed} <= set(r.responses):
            slope = np.gradient(r[angle], r.sample_time_s)
            floor = float(np.hypot(floors[speed], floors[angle] / SLOWEST_MODE_s))
            found.append(_expected(speed, f"the speed of {angle}", r, slope, floor))
    return found


def _winding_current(rig: Rig, r: Recording, floors: dict[str, float]) -> ExpectedReading | None:
    """The current by voltage and speed; none where no column shows how fast the motor turns."""
    volts, resistance = winding_voltage(rig, r), rig.terminal_resistance_ohm
    speed = _motor_speed(rig, r)
    if volts is None or not resistance or speed is None or "current_A" not in r.responses:
        return None
    emf = (rig.back_emf_constant_Vs_per_rad or 0.0) * speed
    if np.std(volts - emf) < EMF_UNSURE * np.std(emf):
        return None  # near its speed without load a small difference of two large voltages
    limit = rig.current_limit_A or np.inf
    current = np.clip((volts - emf) / resistance, -limit, limit)
    source = "the current that the winding's voltage drives"
    return _expected("current_A", source, r, current, floors["current_A"])


def _commanded_current(rig: Rig, r: Recording, floors: dict[str, float]) -> ExpectedReading | None:
    """The current that an amplifier was told to regulate; none while it is disabled.

    An amplifier may limit it below what the rig file says: then the command that is limited to the
    largest current read correlates better with the current than the whole command does.
    """
    given = r.command_name == "current_command_A" and "current_A" in r.responses
    if not given or ("drive_enabled" in r and np.any(r["drive_enabled"] == 0.0)):
        return None
    current, most = r["current_A"], rig.current_limit_A or np.inf
    command = np.clip(r["current_command_A"], -most, most)
    reached = float(np.max(np.abs(current)))
    limited = np.clip(command, -reached, reached)
    if _correlation(limited, current) > _correlation(command, current):
        command = limited
    return _expected("current_A", "current_command_A", r, command, floors["current_A"])


def _correlation(x: NDArray, y: NDArray) -> float:
    """Of two columns (n,); 0 where one of them is constant."""
    if np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return 0.0
    return float(np.corrcoef(x, y)[0, 1])


def _motor_speed(rig: Rig, r: Recording) -> NDArray | float | None:
    """Of the rotor, by the columns that show it; zero where the load is locked."""
    if "motor_angle_rad" in r.responses:
        return np.gradient(r["motor_angle_rad"], r.sample_time_s)
    if "motor_velocity_rad_per_s" in r.responses:
        return r["motor_velocity_rad_per_s"]
    if r.load.kind == "locked" or not rig.back_emf_constant_Vs_per_rad:
        return 0.0
    ratio = rig.gear_ratio or 1.0
    if "load_velocity_rad_per_s" in r.responses:
        return ratio * r["load_velocity_rad_per_s"]
    if "load_angle_rad" in r.responses:
        return ratio * np.gradient(r["load_angle_rad"], r.sample_time_s)
    return None


def gear_output_angle(
    rig: Rig, r: Recording, floors: dict[str, float]
) -> tuple[NDArray, float] | None:
    """The motor's angle behind the gear, and its floor."""
    if "motor_angle_rad" not in r.responses:
        return None
    ratio = rig.gear_ratio or 1.0
    return r["motor_angle_rad"] / ratio, floors["motor_angle_rad"] / ratio


def deflection(
    r: Recording, output: tuple[NDArray, float] | None, floors: dict[str, float]
) -> tuple[NDArray, float] | None:
    """The angles' difference, and its floor; a locked load stays where it starts."""
    if output is None:
        return None
    angle, floor = output
    if r.load.kind == "locked":
        return angle - r.first("load_angle_rad"), floor
    if "load_angle_rad" not in r:
        return None
    return angle - r["load_angle_rad"], float(np.hypot(floor, floors.get("load_angle_rad", 0.0)))


def _expected(
    name: str, source: str, r: Recording, expected: NDArray, floor: float
) -> ExpectedReading:
    return ExpectedReading(
        name=name, source=source, reading=r[name], expected=expected, floor=floor
    )


def winding_voltage(rig: Rig, r: Recording) -> NDArray | None:
    """Volts that the bridge was told to put on the winding; none while it is open."""
    if r.command_name == "voltage_V":
        volts = r["voltage_V"]
    elif r.command_name == "duty" and ("supply_V" in r or rig.supply_voltage_V):
        supply = r["supply_V"] if "supply_V" in r else rig.supply_voltage_V  # noqa: SIM401
        volts = r["duty"] * supply
    else:
        return None
    if "drive_enabled" in r and np.any(r["drive_enabled"] == 0.0):
        return None  # an open bridge's current is none whatever the speed
    return volts


def averaging_rows(rig: Rig, r: Recording) -> int:
    """Rows of an average that no resonance outlives."""
    period = SLOWEST_MODE_s
    if rig.has("spring") and rig.spring_stiffness_Nm_per_rad and rig.load_inertia_kgm2:
        own = np.sqrt(rig.load_inertia_kgm2 / rig.spring_stiffness_Nm_per_rad)
        period = max(period, PERIODS * 2.0 * np.pi * float(own))
    return min(max(1, round(period / r.sample_time_s)), max(1, r.rows // 5))


def slow_part(values: NDArray, window: int) -> NDArray:
    """Means over a window at every row that has a whole one."""
    return moving_means(values - values[0], window)


def moving_means(values: NDArray, window: int) -> NDArray:
    sums = np.cumsum(np.concatenate(([0.0], values)))
    return (sums[window:] - sums[:-window]) / window
