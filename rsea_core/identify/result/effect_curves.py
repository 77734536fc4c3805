"""The law that was identified, as a curve with its band beside the nominal one.

Each curve is drawn from the very numbers that the engine runs on (`Draft`), so that it shows what
is simulated. The band is 1.96 standard deviations of the curve's points as they follow from the
unknowns, the rig's values included (delta method).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import rsea_core.effects.layout as e
import rsea_core.identify.result.curve_arrays as law_arrays
from rsea_core.effects.gear_transmission_error import array_angle_error
from rsea_core.engines.fixed_step.replay import CHANNELS, Numbers
from rsea_core.identify.candidates.candidate import Draft, Law
from rsea_core.identify.candidates.residual_tables import (
    EFFECT,
    PLACE,
    SPEED,
    TURN,
    error_of,
    nodes_of,
)
from rsea_core.identify.fitting.predictions import run_machines
from rsea_core.identify.fitting.problem import Bench, Hypothesis, machine_of
from rsea_core.identify.result.diagnosis_json import Outcome
from rsea_core.machine.spring_table import linear_table

POINTS = 161
STEP = 1e-3  # of an unknown, for the slopes of a curve
Values = Mapping[str, float]
Evaluate = Callable[[Draft, Values, NDArray], NDArray]


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """How one effect is drawn.

    Attributes
    ----------
    over : str
        What `Ranges` gives the ends of.
    evaluate : function of (draft, values, x), the curve (n,)
    """

    title: str
    x_label: str
    y_label: str
    over: str
    evaluate: Evaluate


class Ranges:
    """Ends of what a machine passed through in its recordings, by name."""

    def __init__(self, outcome: Outcome):
        problem, fit = outcome.problem, outcome.fit
        self._ends: dict[str, tuple[float, float]] = {}
        for bench in problem.fitted:
            draft = problem.trial_machine(bench, fit.hypothesis, fit.x)
            run = run_machines(bench.replay, [draft], bench.where)[0]
            at = {name: run[:, j] for j, name in enumerate(CHANNELS)}
            time, ratio = bench.recording.time_s, bench.where.ratio
            wheel, load = at["motor_angle_rad"] / ratio, at["load_angle_rad"]
            self._add("wheel_angle", wheel)
            self._add("wheel_speed", np.gradient(wheel, time))
            self._add("load_angle", load)
            self._add("load_speed", np.gradient(load, time))
            self._add("deflection", wheel - load)
            for name in ("motor_angle_rad", "load_angle_rad"):
                self._add(f"rate of {name}", np.abs(np.gradient(at[name], time)))
            self._add("torque", at["torque_Nm"])
            self._add("current", at["current_A"])
            self._add("time", time - time[0])
            if np.isfinite(angle := machine_of(bench.base).contact_angle):
                self._add("depth", np.maximum(load - angle, 0.0))
            for name in bench.channels:
                self._add(name, bench.measured[:, bench.channels.index(name)])
            if bench.recording.command_name is not None:
                self._add("command", bench.recording[bench.recording.command_name])

    def _add(self, name: str, values: NDArray) -> None:
        if np.all(np.isfinite(values)):
            low, high = self._ends.get(name, (np.inf, -np.inf))
            self._ends[name] = min(low, float(values.min())), max(high, float(values.max()))

    def grid(self, name: str) -> NDArray | None:
        """Points from end to end; None where nothing moved."""
        low, high = self._ends.get(name, (0.0, 0.0))
        return np.linspace(low, high, POINTS) if high > low else None


def law_curves(outcome: Outcome) -> list[dict]:
    """The curves of the laws found, as the report's page has them."""
    if not outcome.fit.hypothesis.laws:
        return []
    ranges = Ranges(outcome)
    found = [_curve(outcome, j, law, ranges) for j, law in enumerate(outcome.fit.hypothesis.laws)]
    return [curve for curve in found if curve is not None]


def _curve(outcome: Outcome, j: int, law: Law, ranges: Ranges) -> dict | None:
    drawn = drawn_of(law)
    grid = None if drawn is None else ranges.grid(drawn.over)
    if grid is None:
        return None
    problem, fit = outcome.problem, outcome.fit
    bench = _bench_of(outcome, law)

    def at(x: NDArray) -> NDArray:
        values = problem.values(fit.hypothesis, x)[1][j]
        return drawn.evaluate(problem.trial_machine(bench, fit.hypothesis, x), values, grid)

    plain = Hypothesis()
    found = at(fit.x)
    nominal = drawn.evaluate(problem.trial_machine(bench, plain, problem.start(plain)), {}, grid)
    ways = STEP * np.eye(fit.x.size)
    slopes = np.array([(at(fit.x + d) - at(fit.x - d)) / (2.0 * STEP) for d in ways])
    band = 1.96 * np.sqrt([outcome.spread.variance(slope) for slope in slopes.T])
    return {
        "title": drawn.title, "x_label": drawn.x_label, "y_label": drawn.y_label, "x": grid,
        "nominal": nominal, "found": found, "low": found - band, "high": found + band,
    }  # fmt: skip


def _bench_of(outcome: Outcome, law: Law) -> Bench:
    """A recording that the law acts in."""
    fitted = outcome.problem.fitted
    if law.only is not None:
        return next((b for b in fitted if b.recording.file == law.only), fitted[0])
    kind = "contact" if law.subsystem == "environment" else None
    return next((b for b in fitted if kind in (None, b.recording.load.kind)), fitted[0])


def drawn_of(law: Law) -> Drawn | None:
    """How a law is drawn; None of those that a number says it all of (delays, heat)."""
    if law.effect == EFFECT:
        return _unnamed(law)
    if law.sensor is not None:
        return _sensor(law)
    if law.law == "dead time":
        return Drawn(
            title="Dead time of the bridge", x_label="current (A)", y_label="voltage lost (V)",
            over="current", evaluate=_dead_time,
        )  # fmt: skip
    return DRAWN.get(law.effect)


# ---- drive and gear


def _dead_time(d: Draft, v: Values, x: NDArray) -> NDArray:
    return law_arrays.dead_time_volts(d.fx, _plant(d), x)


def _dead_zone(d: Draft, v: Values, x: NDArray) -> NDArray:
    return law_arrays.acting_commands(d.fx, x)


def _given_volts(d: Draft, v: Values, x: NDArray) -> NDArray:
    """Volts left of a full supply at a current; none beyond the limit."""
    plant = _plant(d)
    volts = plant.volts_per_command - d.fx[e.SOURCE_RESISTANCE] * np.abs(x)
    return np.where(np.abs(x) <= plant.current_limit, volts, np.nan)


def _gear_friction(d: Draft, v: Values, x: NDArray) -> NDArray:
    dry_and_smooth = law_arrays.gear_friction(d.fx, x)
    return dry_and_smooth + _plant(d).damping * x + d.fx[e.GEAR_OFFSET]


def _gear_load_friction(d: Draft, v: Values, x: NDArray) -> NDArray:
    fx = d.fx.copy()
    fx[[e.GEAR_FORWARD, e.GEAR_BACKWARD]] = 0.0
    return law_arrays.carried_friction(fx, x)


def _cogging(d: Draft, v: Values, x: NDArray) -> NDArray:
    return law_arrays.wheel_torques(d.fx, x)


def _transmission_error(d: Draft, v: Values, x: NDArray) -> NDArray:
    return array_angle_error(d.fx, x, _plant(d).gear_ratio)


def _lost_motion(d: Draft, v: Values, x: NDArray) -> NDArray:
    return 0.5 * d.fx[e.BACKLASH] * np.sign(x)


# ---- spring


def _spring(d: Draft, v: Values, x: NDArray) -> NDArray:
    regions = linear_table(d.stiffness).regions if d.spring is None else d.spring
    return law_arrays.spring_torques(regions, x)


def _ascending(d: Draft, v: Values, x: NDArray) -> NDArray:
    """What the memory adds while the deflection grows, after a turn at the lowest one."""
    return law_arrays.ascending(d.fx, x)


# ---- load and contact


def _load_friction(d: Draft, v: Values, x: NDArray) -> NDArray:
    return law_arrays.load_friction(d.fx, x) + _plant(d).load_damping * x


def _drag(d: Draft, v: Values, x: NDArray) -> NDArray:
    return law_arrays.load_torques(d.fx, 0.0 * x, x)[1] + _plant(d).load_damping * x


def _by_place(d: Draft, v: Values, x: NDArray) -> NDArray:
    plant = _plant(d)
    more = law_arrays.load_torques(d.fx, x, 0.0 * x)[0]
    return more - plant.gravity * np.sin(x + plant.gravity_offset)


def _pushed(d: Draft, v: Values, x: NDArray) -> NDArray:
    return law_arrays.pulses(d.fx, x, x[1] - x[0])


def _contact(d: Draft, v: Values, x: NDArray) -> NDArray:
    plant = _plant(d)
    if d.fx[e.EXPONENT] == 0.0:
        return plant.contact_stiffness * x
    return law_arrays.contact_torques(d.fx, plant.contact_stiffness, x)


def _plant(d: Draft):
    return machine_of(Numbers(d.plant, np.zeros((2, 6)), d.fx))


DRAWN: dict[str, Drawn] = {
    "drive-dead-zone": Drawn(
        title="Dead zone of the drive", x_label="duty asked for", y_label="duty that acts",
        over="command", evaluate=_dead_zone,
    ),
    "drive-saturation": Drawn(
        title="Volts left of a full supply", x_label="current (A)", y_label="voltage (V)",
        over="current", evaluate=_given_volts,
    ),
    "gear-friction": Drawn(
        title="Friction of motor and gear", x_label="wheel speed (rad/s)",
        y_label="friction at the wheel (Nm)", over="wheel_speed", evaluate=_gear_friction,
    ),
    "gear-load-friction": Drawn(
        title="Friction of the gear under load, turning forward", x_label="torque carried (Nm)",
        y_label="friction at the wheel (Nm)", over="torque", evaluate=_gear_load_friction,
    ),
    "motor-cogging": Drawn(
        title="Torque over the motor's angle", x_label="wheel angle (rad)",
        y_label="torque at the wheel (Nm)", over="wheel_angle", evaluate=_cogging,
    ),
    "gear-transmission-error": Drawn(
        title="Error of the gear's output", x_label="wheel angle (rad)", y_label="error (rad)",
        over="wheel_angle", evaluate=_transmission_error,
    ),
    "gear-backlash": Drawn(
        title="Lost motion of the gear", x_label="torque carried (Nm)", y_label="angle (rad)",
        over="torque", evaluate=_lost_motion,
    ),
    "spring-hardening": Drawn(
        title="Torque of the spring", x_label="deflection (rad)", y_label="torque (Nm)",
        over="deflection", evaluate=_spring,
    ),
    "spring-contact": Drawn(
        title="Torque of the spring", x_label="deflection (rad)", y_label="torque (Nm)",
        over="deflection", evaluate=_spring,
    ),
    "spring-hysteresis": Drawn(
        title="Torque that the spring's memory adds on the way up", x_label="deflection (rad)",
        y_label="torque (Nm)", over="deflection", evaluate=_ascending,
    ),
    "load-friction": Drawn(
        title="Friction of the load's joint", x_label="load speed (rad/s)",
        y_label="friction (Nm)", over="load_speed", evaluate=_load_friction,
    ),
    "load-drag": Drawn(
        title="Drag of the load", x_label="load speed (rad/s)", y_label="drag (Nm)",
        over="load_speed", evaluate=_drag,
    ),
    "load-unbalance": Drawn(
        title="Torque that pulls on the load where it is", x_label="load angle (rad)",
        y_label="torque (Nm)", over="load_angle", evaluate=_by_place,
    ),
    "spring-parallel": Drawn(
        title="Torque that pulls on the load where it is", x_label="load angle (rad)",
        y_label="torque (Nm)", over="load_angle", evaluate=_by_place,
    ),
    "load-disturbance": Drawn(
        title="Push on the load", x_label="time (s)", y_label="torque (Nm)", over="time",
        evaluate=_pushed,
    ),
    "contact-nonlinear": Drawn(
        title="Torque of the contact", x_label="depth (rad)", y_label="torque (Nm)", over="depth",
        evaluate=_contact,
    ),
}  # fmt: skip


# ---- readings, and what has no name


def _sensor(law: Law) -> Drawn | None:
    """A reading's error over what is true, or over time."""
    drifts = law.effect == "sensor-drift"
    if not drifts and law.effect not in ("sensor-offset", "sensor-scale"):
        return None
    unit = law.sensor.rsplit("_", 1)[-1]

    def error(d: Draft, v: Values, x: NDArray) -> NDArray:
        if drifts:
            return v.get("rate_per_s", 0.0) * x
        return v.get("offset", 0.0) + (v.get("scale", 1.0) - 1.0) * x

    return Drawn(
        title=f"Error of the reading {law.sensor}",
        x_label="time (s)" if drifts else f"true value ({unit})", y_label=f"error ({unit})",
        over="time" if drifts else law.sensor, evaluate=error,
    )  # fmt: skip


def _unnamed(law: Law) -> Drawn:
    """A table of what no effect explains."""
    if law.law == PLACE:
        return DRAWN["load-unbalance"]
    unit = law.sensor.rsplit("_", 1)[-1]

    def error(d: Draft, v: Values, x: NDArray) -> NDArray:
        if not v:
            return np.zeros(x.size)
        if law.law == SPEED:
            return np.interp(x, *nodes_of(v))
        return error_of(law.law, *nodes_of(v), x, x)

    if law.law == SPEED:
        return Drawn(
            title=f"Share of its motion that {law.sensor} shows too much",
            x_label="speed (rad/s)", y_label="share", over=f"rate of {law.sensor}", evaluate=error,
        )  # fmt: skip
    return Drawn(
        title=f"Error of the reading {law.sensor}" + (", each turn" if law.law == TURN else ""),
        x_label=f"true value ({unit})", y_label=f"error ({unit})", over=law.sensor, evaluate=error,
    )  # fmt: skip
