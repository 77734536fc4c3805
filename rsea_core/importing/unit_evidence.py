"""What the numbers of a log say about units: laws that have to hold between columns and a rig file.

Every law compares scales: winding (volts against current and speed), gear (both angles), spring
(torque against deflection), derivative (velocity against angle), sensors (steps against counts,
scatter against stated noise). Each has a tolerance, in natural logarithms, that missing physics of
such machines stays within.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.machine.inputs import POSITION_COMMAND
from rsea_core.machine.rig import Rig, is_linear

WINDING_TOLERANCE, GEAR_TOLERANCE, SPRING_TOLERANCE = 0.30, 0.12, 0.30
DERIVATIVE_TOLERANCE, COUNT_TOLERANCE, NOISE_TOLERANCE = 0.08, 0.01, 0.45
WORST = 30.0  # what one law can hold against a hypothesis, in log-likelihood units
WORST_EXCESS = 14.0  # less than a stated unit is worth: friction that nobody stated may explain it
TOGETHER = 0.8
FOLLOWS = 0.95  # correlation of a load that follows its motor
FEW = 50
MOST_ROWS = 40_000
RESOLVED = 8.0  # steps of one size that a moving column has to be long
MOSTLY = 0.95  # of the moves of a column


@dataclass(frozen=True, kw_only=True)
class Law:
    """One comparison: what a hypothesis makes of a scale that should be 1.

    Attributes
    ----------
    text : str
        For people, with the number that decides.
    ratio : float
        Found over expected; negative: of the other sign.
    tolerance : float
        Standard deviation of its logarithm.
    columns : tuple of str
        The readings that it ties.
    held : float
        Log-likelihood units for a law that holds in few units of its columns, in others not
        at all: without a relation between its columns there is nothing to compare.
    inverse : bool
        Whether the scale found falls as the last reading grows.
    is_excess : bool
        More than is needed, where friction that nobody stated may be what needs it.
    """

    text: str
    ratio: float
    tolerance: float
    columns: tuple[str, ...]
    held: float = 0.0
    inverse: bool = False
    is_excess: bool = False

    @property
    def missing_scale(self) -> float:
        """Factor on the last reading that makes the scale 1."""
        return abs(self.ratio) if self.inverse else 1.0 / max(abs(self.ratio), 1e-300)

    def score(self) -> float:
        """Log-likelihood of the scale, never below -`WORST`; a wrong sign is the worst."""
        if not self.ratio > 0.0:
            return -WORST
        return self.size_score()

    def size_score(self) -> float:
        """The same without the sign."""
        size = abs(self.ratio)
        if not size > 0.0 or not np.isfinite(size):
            return -WORST
        worst = WORST_EXCESS if self.is_excess else WORST
        return self.held - min(0.5 * (np.log(size) / self.tolerance) ** 2, worst)


def step_of(values: NDArray) -> float | None:
    """The step of a column that moves in multiples of one size; None where it has none."""
    moved = np.abs(np.diff(values[:MOST_ROWS]))
    moved = moved[moved > 1e-12 * max(1.0, float(np.abs(values).max()))]
    if moved.size < RESOLVED:
        return None
    step = float(np.min(moved))
    low = moved[moved < 20.5 * step]
    if low.size < RESOLVED:
        return None
    step = float(np.sum(low) / np.sum(np.round(low / step)))
    multiple = low / step
    whole = np.round(multiple)
    if np.percentile(np.abs(multiple - whole), 98.0) >= 0.02 * max(1.0, multiple.max() / 20.0):
        return None
    # rows that were filled between two neighbours lie at parts of a step
    parts = next((k for k in (6, 3, 2) if np.mean(whole % k == 0.0) > MOSTLY), 1)
    one_size = np.mean(whole == parts) > MOSTLY
    return None if one_size and not _rests_between(values) else parts * step


def _rests_between(values: NDArray) -> bool:
    """Whether a column rests between moves: at one speed all moves are of one size without it."""
    moves = np.diff(values[:MOST_ROWS]) != 0.0
    return int(np.sum(~moves[1:-1] & moves[:-2] & moves[2:])) >= RESOLVED or bool(
        np.mean(moves) < 0.5
    )


def slow_of(values: NDArray, window: int) -> NDArray:
    """Means over so many rows, less the first value."""
    sums = np.cumsum(np.concatenate(([0.0], values - values[0])))
    return (sums[window:] - sums[:-window]) / window


def _means(values: NDArray, rows: int) -> NDArray:
    """Means over the rows between two that are so far apart."""
    return slow_of(values, rows)[:-1] + values[0]


def window_of(time: NDArray) -> int:
    """Rows in a tenth of a second: what slow parts are averaged over."""
    step = float(np.median(np.diff(time)))
    return int(np.clip(round(0.1 / step) if step > 0 else 1, 3, max(3, time.size // 20)))


def correlation_of(x: NDArray, y: NDArray) -> float:
    """Correlation coefficient; 0 where one of the two stands still."""
    x, y = x - np.mean(x), y - np.mean(y)
    size = float(np.sqrt(np.sum(x**2) * np.sum(y**2)))
    return float(np.sum(x * y)) / size if size > 0.0 else 0.0


def scale_of(x: NDArray, y: NDArray) -> tuple[float, float]:
    """Signed slope of y over x by their spreads, and the correlation."""
    if np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return 0.0, 0.0
    correlation = correlation_of(x, y)
    return float(np.sign(correlation) * np.std(y) / np.std(x)), correlation


def derivative_laws(rig: Rig | None, c: Mapping[str, NDArray], ratio: float) -> list[Law]:
    """A logged velocity against the derivative of its angle."""
    found = []
    for side in ("motor", "load"):
        angle, speed = f"{side}_angle_rad", f"{side}_velocity_rad_per_s"
        if angle in c and speed in c and "time_s" in c:
            n = window_of(c["time_s"]) // 2 + 2
            # the means of a speed over rows, against what the angle passes in them
            x = (c[angle][n:] - c[angle][:-n]) / np.maximum(
                c["time_s"][n:] - c["time_s"][:-n], 1e-12
            )
            slope, together = scale_of(x, _means(c[speed], n))
            if abs(together) > TOGETHER:
                text = f"{speed} is {slope:.3g} times the derivative of {angle}"
                names = (angle, speed, "time_s")
                found.append(Law(text=text, ratio=slope, tolerance=DERIVATIVE_TOLERANCE,
                                 columns=names))  # fmt: skip
    return found


def gear_laws(rig: Rig | None, c: Mapping[str, NDArray], ratio: float) -> list[Law]:
    """Both angles of a gear, where the load follows the motor."""
    names = ("motor_angle_rad", "load_angle_rad")
    if not all(n in c for n in names):
        return []
    n = window_of(c["time_s"])
    slope, together = scale_of(slow_of(c[names[0]] / ratio, n), slow_of(c[names[1]], n))
    if abs(together) < FOLLOWS:
        return []
    text = f"load_angle_rad is {slope:.3g} times motor_angle_rad over the gear ratio {ratio:g}"
    return [Law(text=text, ratio=slope, tolerance=GEAR_TOLERANCE, columns=names)]


def servo_laws(rig: Rig | None, c: Mapping[str, NDArray], ratio: float) -> list[Law]:
    """The angle of the gear's output, which follows the goal of a position loop."""
    goal, time = c.get(POSITION_COMMAND), c.get("time_s")
    name = "load_angle_rad" if "load_angle_rad" in c else "motor_angle_rad"
    if goal is None or name not in c or time is None:
        return []
    angle = c[name] / (1.0 if name == "load_angle_rad" else ratio)
    n = 2 * window_of(time)
    slope, together = scale_of(slow_of(goal, n), slow_of(angle, n))
    if abs(together) < TOGETHER:
        return []
    text = f"{name} follows {POSITION_COMMAND} by {slope:.3g}"
    return [
        Law(text=text, ratio=slope, tolerance=SPRING_TOLERANCE, columns=(POSITION_COMMAND, name))
    ]


def current_laws(rig: Rig | None, c: Mapping[str, NDArray], ratio: float) -> list[Law]:
    """The current against the one that is commanded."""
    names = ("current_command_A", "current_A")
    if not all(n in c for n in names):
        return []
    slope, together = scale_of(*(slow_of(c[n], window_of(c["time_s"]) // 4 + 1) for n in names))
    if abs(together) < TOGETHER:
        return []
    text = f"current_A is {slope:.3g} times current_command_A"
    return [Law(text=text, ratio=slope, tolerance=GEAR_TOLERANCE, columns=names)]


def volts_of(rig: Rig, c: Mapping[str, NDArray]) -> tuple[str, NDArray] | None:
    """The column that puts volts on the winding, and these."""
    if "voltage_V" in c:
        return "voltage_V", c["voltage_V"]
    if "duty" in c and rig.supply_voltage_V:
        return "duty", c["duty"] * rig.supply_voltage_V
    return None


def winding_laws(rig: Rig, c: Mapping[str, NDArray], ratio: float) -> list[Law]:
    """R and k_e as the columns have them, by least squares, where the fit is good."""
    volts, R, k_e = volts_of(rig, c), rig.terminal_resistance_ohm, rig.back_emf_constant_Vs_per_rad
    sides = ("motor",) if rig.has("spring") else ("motor", "load")
    motions = [f"{side}_{kind}" for side in sides for kind in ("angle_rad", "velocity_rad_per_s")]
    motion = next((n for n in motions if n in c), None)
    if volts is None or not (R and k_e and "current_A" in c and motion):
        return []
    n = window_of(c["time_s"])
    n = max(2, n // 4)
    moved = c[motion] * (ratio if motion.startswith("load") else 1.0)
    speed = _means(moved, n)
    if motion.endswith("angle_rad"):
        speed = (moved[n:] - moved[:-n]) / np.maximum(c["time_s"][n:] - c["time_s"][:-n], 1e-12)
    A = np.stack([_means(c["current_A"], n), speed], axis=1)
    v = _means(volts[1], n)
    scale = np.std(A, axis=0)
    if np.any(scale == 0.0) or np.std(v) == 0.0:
        return []
    B = A / scale
    if np.linalg.cond(B) > 30.0:
        return []
    x, *_ = np.linalg.lstsq(B, v, rcond=None)
    left = float(np.mean((v - B @ x) ** 2) / np.mean(v**2))
    share = np.abs(x) * np.std(B, axis=0) / np.std(v)
    found, values = [], x / scale
    expected = ((R, "R", "current_A"), (k_e, "k_e", motion))
    for k, (value, symbol, name) in enumerate(expected):
        if left < 0.15 and share[k] > 0.15 + np.sqrt(left):
            text = f"the winding shows {symbol} {values[k] / value:.3g} times rig.toml's"
            names = (volts[0], name) if k == 0 else (volts[0], name, "time_s")
            tolerance = WINDING_TOLERANCE + np.sqrt(left)
            found.append(Law(text=text, ratio=float(values[k] / value), tolerance=tolerance,
                             columns=names, inverse=True))  # fmt: skip
    return found


def spring_laws(rig: Rig, c: Mapping[str, NDArray], ratio: float) -> list[Law]:
    """The torque sensor against stiffness times deflection; without a load angle it is held."""
    K = rig.spring_stiffness_Nm_per_rad
    if not K or not rig.has("spring") or "torque_Nm" not in c:
        return []
    names: tuple[str, ...] = ("motor_angle_rad", "torque_Nm")
    if "spring_deflection_rad" in c:
        names, deflection = ("spring_deflection_rad", "torque_Nm"), c["spring_deflection_rad"]
    elif "motor_angle_rad" not in c:
        return []
    else:
        deflection = c["motor_angle_rad"] / ratio
        if "load_angle_rad" in c:
            names, deflection = (*names, "load_angle_rad"), deflection - c["load_angle_rad"]
    n = max(3, window_of(c["time_s"]) // 4)
    slope, together = scale_of(slow_of(K * deflection, n), slow_of(c["torque_Nm"], n))
    if abs(together) < TOGETHER:
        return []
    text = f"torque_Nm is {slope:.3g} times the spring's stiffness times its deflection"
    return [Law(text=text, ratio=slope, tolerance=SPRING_TOLERANCE, columns=names)]


def sensor_laws(
    rig: Rig, c: Mapping[str, NDArray], ratio: float, *, scale: float = 1.0
) -> list[Law]:
    """Steps against encoder counts, scatter against stated noise.

    Parameters
    ----------
    scale : float
        Of the columns, which are as logged.
    """
    found = []
    counts = {"motor_angle_rad": rig.motor_encoder_counts_per_rev,
              "load_angle_rad": rig.load_encoder_counts_per_rev}  # fmt: skip
    per = " (of a linear axis: counts per metre times 2 pi)" if is_linear(rig) else ""
    noises = {"current_A": rig.current_sensor_noise_A, "torque_Nm": rig.torque_sensor_noise_Nm}
    for name, values in c.items():
        step = step_of(values) if counts.get(name) else None
        if step is not None:
            share = step * abs(scale) * counts[name] / (2.0 * np.pi)
            text = f"{name} moves in steps of {share:.4g} counts of rig.toml's encoder{per}"
            found.append(Law(text=text, ratio=share, tolerance=COUNT_TOLERANCE, columns=(name,)))
        scatter = scatter_of(values) if noises.get(name) and values.size >= FEW else 0.0
        if scatter > 0.0:
            share = scatter * abs(scale) / noises[name]
            text = f"{name} scatters by {share:.3g} times the stated noise"
            found.append(Law(text=text, ratio=share, tolerance=NOISE_TOLERANCE, columns=(name,)))
    return found


def scatter_of(values: NDArray) -> float:
    """Noise from row to row, by the median of second differences."""
    second = np.abs(np.diff(values[:MOST_ROWS], 2))
    return float(np.median(second)) / (0.6745 * np.sqrt(6.0))
