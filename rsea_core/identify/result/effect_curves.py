"""The law that was identified, as a curve with its band beside the nominal one.

Each curve is drawn from the very numbers that the engine runs on (`TrialMachine`), so that it
shows what is simulated. The band is 1.96 standard deviations of the curve's points as they follow
from the unknowns, the rig's values included (delta method).
"""

import numpy as np
from numpy.typing import NDArray

import rsea_core.identify.result.curve_arrays as curve_arrays
from rsea_core.effects.curve import EffectCurve
from rsea_core.effects.load_disturbance import LoadDisturbance
from rsea_core.effects.residual_table import EFFECT, draw_table
from rsea_core.effects.spring_hysteresis import SpringHysteresis
from rsea_core.effects.spring_viscoelastic import SpringViscoelastic
from rsea_core.effects.variant import Law, TrialMachine, Values
from rsea_core.engines.fixed_step.replay import CHANNELS
from rsea_core.identify.fitting.problem import PreparedRecording, machine_of
from rsea_core.identify.result.conclusion import Conclusion

POINTS = 161
STEP = 1e-3  # of an unknown, for the slopes of a curve


class Ranges:
    """Ends of what a machine passed through in its recordings, by name."""

    def __init__(self, conclusion: Conclusion):
        problem, fit = conclusion.problem, conclusion.fit
        self._ends: dict[str, tuple[float, float]] = {}
        for prepared in problem.fitted:
            trial = problem.trial_machine(prepared, fit.hypothesis, fit.x)
            run = prepared.runs([trial])[0]
            at = {name: run[:, j] for j, name in enumerate(CHANNELS)}
            time, ratio = prepared.recording.time_s, prepared.where.ratio
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
            if np.isfinite(angle := machine_of(prepared.base).contact_angle):
                self._add("depth", np.maximum(load - angle, 0.0))
            for name in prepared.channels:
                self._add(name, prepared.measured[:, prepared.channels.index(name)])
            if prepared.recording.command_name is not None:
                self._add("command", prepared.recording[prepared.recording.command_name])

    def _add(self, name: str, values: NDArray) -> None:
        if np.all(np.isfinite(values)):
            low, high = self._ends.get(name, (np.inf, -np.inf))
            self._ends[name] = min(low, float(values.min())), max(high, float(values.max()))

    def grid(self, name: str) -> NDArray | None:
        """Points from end to end; None where nothing moved."""
        low, high = self._ends.get(name, (0.0, 0.0))
        return np.linspace(low, high, POINTS) if high > low else None


def law_curves(conclusion: Conclusion) -> list[dict]:
    """The curves of the laws found, as the report's page has them."""
    if not conclusion.fit.hypothesis.laws:
        return []
    ranges = Ranges(conclusion)
    laws = conclusion.fit.hypothesis.laws
    found = [_curve(conclusion, j, law, ranges) for j, law in enumerate(laws)]
    loops = [_loop(conclusion, law) for law in laws if law.effect in LOOPS]
    return [curve for curve in (*loops[:1], *found) if curve is not None]


def _loop(conclusion: Conclusion, law: Law) -> dict | None:
    """Torque against deflection over a recording: read, and simulated with and without the law.

    None where the torque or an angle was not read.
    """
    prepared, plain = _prepared_of(conclusion, law), conclusion.problem.nominal
    needed = ("torque_Nm", "motor_angle_rad", "load_angle_rad")
    if not set(needed) <= set(prepared.channels):
        return None
    problem, fit, ratio = conclusion.problem, conclusion.fit, prepared.where.ratio
    machines = [problem.trial_machine(prepared, fit.hypothesis, fit.x),
                problem.trial_machine(prepared, plain, problem.start(plain))]  # fmt: skip
    column = {name: j for j, name in enumerate(CHANNELS)}
    with_law, without = prepared.runs(machines)
    torque, motor, load = (prepared.measured[:, prepared.channels.index(name)] for name in needed)
    at = [column[name] for name in needed[1:]]
    deflection = with_law[:, at[0]] / ratio - with_law[:, at[1]]
    simulated = with_law[:, column["torque_Nm"]]
    straight = without[:, at[0]] / ratio - without[:, at[1]]
    order = np.argsort(straight)
    nominal = np.interp(deflection, straight[order], without[order, column["torque_Nm"]])
    return {
        "title": f"Torque over deflection in {prepared.recording.file}",
        "x_label": "deflection (rad)", "y_label": "torque (Nm)", "x": deflection,
        "nominal": nominal, "found": simulated, "low": simulated, "high": simulated,
        "points": (motor / ratio - load, torque),
        "caption": f"The loop in {prepared.recording.file}. Points: torque read, over the"
        " deflection that the encoders read; lines: simulated with the law and with the nominal"
        " machine.",
    }  # fmt: skip


def _curve(conclusion: Conclusion, j: int, law: Law, ranges: Ranges) -> dict | None:
    drawn = drawn_of(law)
    grid = None if drawn is None else ranges.grid(drawn.over)
    if grid is None:
        return None
    problem, fit = conclusion.problem, conclusion.fit
    prepared = _prepared_of(conclusion, law)

    def at(x: NDArray) -> NDArray:
        values = problem.values(fit.hypothesis, x)[1][j]
        return drawn.evaluate(problem.trial_machine(prepared, fit.hypothesis, x), values, grid)

    plain = problem.nominal
    found = at(fit.x)
    nominal = drawn.evaluate(problem.trial_machine(prepared, plain, problem.start(plain)), {}, grid)
    offsets = STEP * np.eye(fit.x.size)
    derivatives = np.array([(at(fit.x + d) - at(fit.x - d)) / (2.0 * STEP) for d in offsets])
    band = 1.96 * np.sqrt([conclusion.spread.variance(slope) for slope in derivatives.T])
    return {
        "title": drawn.title, "x_label": drawn.x_label, "y_label": drawn.y_label, "x": grid,
        "nominal": nominal, "found": found, "low": found - band, "high": found + band,
    }  # fmt: skip


def _prepared_of(conclusion: Conclusion, law: Law) -> PreparedRecording:
    """A recording that the law acts in."""
    fitted = conclusion.problem.fitted
    if law.only is not None:
        return next((b for b in fitted if b.recording.file == law.only), fitted[0])
    kind = "contact" if law.subsystem == "environment" else None
    return next((b for b in fitted if kind in (None, b.recording.load.kind)), fitted[0])


def drawn_of(law: Law) -> EffectCurve | None:
    """How a variant is drawn; None of those that a number says it all of (delays, heat)."""
    if law.effect == EFFECT:
        return draw_table(law)
    if law.sensor is not None:
        at = getattr(law.kind, "curve_at", None)
        return None if at is None else at(law.sensor)
    return law.kind.curve or BY_ENGINE.get(law.effect)


def _ascending(d: TrialMachine, v: Values, x: NDArray) -> NDArray:
    """What the memory adds while the deflection grows, after a turn at the lowest one."""
    return curve_arrays.ascending(d.fx, x)


def _pulse(d: TrialMachine, v: Values, x: NDArray) -> NDArray:
    return curve_arrays.pulses(d.fx, x, x[1] - x[0])


BY_ENGINE = {
    SpringHysteresis.effect: EffectCurve(
        title="Torque that the spring's memory adds on the way up", x_label="deflection (rad)",
        y_label="torque (Nm)", over="deflection", evaluate=_ascending,
    ),
    LoadDisturbance.effect: EffectCurve(
        title="External torque on the load", x_label="time (s)", y_label="torque (Nm)", over="time",
        evaluate=_pulse,
    ),
}  # fmt: skip
"""Curves that are made of an engine's steps."""
LOOPS = (SpringHysteresis.effect, SpringViscoelastic.effect)
