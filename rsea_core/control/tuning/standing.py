"""Whether a loop may be ranked: stable by the judge that fits its law, and at rest after a step.

A linear law is judged by the poles and margins of its sampled loop. A fuzzy table or a power law
has other gains at other amplitudes, and a contact or a dry joint is no linear machine, so that
every loop is also run: steps of three amplitudes on the engine with located events, each of which
must come to rest. For fuzzy and power laws the describing function gives the margins at those
amplitudes; a fuzzy table, whose gain is largest near zero, must keep the same distance from -1 as a
linear loop at rest and down to a few counts of the encoder that moves.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.control.closed_loop import simulate_closed_loop
from rsea_core.control.laws.base import Controller
from rsea_core.control.stability.describing_functions import AmplitudeMargins, amplitude_margins
from rsea_core.control.stability.margins import (
    STABLE_RADIUS,
    LoopMargins,
    loop_margins,
    pole_radius,
    require_stable,
    slowest_swing_Hz,
)
from rsea_core.control.stability.oscillation import Oscillation, oscillation, unrest
from rsea_core.control.tuning.tune_task import FOLLOWED, Task, run_all
from rsea_core.engines.fixed_step.layout import CHANNELS
from rsea_core.errors import ControllerError, RseaError
from rsea_core.machine.quantities import count_angle_rad
from rsea_core.simulation.reference import AngleReference, Reference, largest_amplitude

SHARES = (0.1, 0.5, 1.0)  # of the task's own amplitude
FINEST = 1e-3  # of the task's amplitude: the smallest at which a fuzzy table is judged
AMPLITUDES = 5  # of the describing function below the steps'
SLOWEST_Hz = 0.5  # of it there: a swing of so few counts is fast
RUN_s, SWINGS, LONGEST_s = 2.0, 20.0, 20.0  # of a run: periods of the slowest swing, at most
LONGER = 8.0  # times as long a second run of what was not at rest yet
COUNTS = 3.0  # of the encoders: a smaller oscillation is their resolution
SMALLEST = 0.01  # of the task's amplitude
STILL = 0.02  # of a step: what a loop at rest may still move by


@dataclass(frozen=True, kw_only=True)
class Standing:
    """What a loop's stability was found to be.

    Attributes
    ----------
    reasons : tuple of str
        Why it is not ranked; empty where it is.
    margins : LoopMargins or None
        Of the linear loop at rest; None for a law without a gain there, or one of the angle.
    by_amplitude : tuple of AmplitudeMargins
        By the describing function, for fuzzy and power laws, the smallest amplitude first.
    oscillations : tuple of (float, Oscillation)
        Amplitude of the step, and what did not die out after it.
    """

    reasons: tuple[str, ...]
    margins: LoopMargins | None
    by_amplitude: tuple[AmplitudeMargins, ...]
    oscillations: tuple[tuple[float, Oscillation], ...]

    @property
    def is_ranked(self) -> bool:
        """Whether nothing speaks against a rank."""
        return not self.reasons

    @property
    def gain_and_phase(self) -> tuple[float | None, float | None]:
        """Gain [dB] by which the loop may grow, and phase margin [deg], by the judge that fits.

        The smallest over the amplitudes of a describing function, else the linear ones; None where
        there is neither.
        """
        if self.by_amplitude:
            found = self.by_amplitude
            return min(a.gain_margin_dB for a in found), min(a.phase_margin_deg for a in found)
        m = self.margins
        if m is None:
            return None, None
        return m.gain_rise_dB if m.is_stable else m.gain_fall_dB, m.phase_margin_deg


def standing(task: Task, controller: Controller) -> Standing:
    """Judge the stability of a controller on the first load of a task.

    Raises
    ------
    RseaError
        If the controller cannot be used with the machine.
    """
    known, load = task.known_model or task.model, task.loads[0]
    torque = controller.reference_name == "reference_torque_Nm"
    margins = None
    if torque and controller.has_gain_at_rest:
        margins = loop_margins(known, controller, load)
    amplitude = largest_amplitude(task.reference)
    sizes = tuple(share * amplitude for share in SHARES)
    by_amplitude = _by_amplitude(task, controller, sizes)
    reasons = [*_at_rest(task, controller, margins), *_swinging(task, by_amplitude)]
    swings = []
    for size in sizes:
        found = _after_step(task, controller, size)
        if isinstance(found, Oscillation):
            swings.append((size, found))
            reasons.append(f"{found} {task.reference.unit} after a step of {size:.3g}")
        elif found is not None:
            reasons.append(f"step of {size:.3g} {task.reference.unit}: {found}")
    return Standing(
        reasons=tuple(reasons),
        margins=margins,
        by_amplitude=by_amplitude,
        oscillations=tuple(swings),
    )


def _at_rest(task: Task, controller: Controller, margins: LoopMargins | None) -> list[str]:
    """What speaks against the loop's linear analysis at rest, where it has one."""
    known, load = task.known_model or task.model, task.loads[0]
    if not controller.has_gain_at_rest:
        return []
    if margins is None:
        radius = pole_radius(known, controller, load)
        return [] if radius < STABLE_RADIUS else [f"pole radius {radius:.5g} at rest"]
    try:
        require_stable(known, controller, load)
    except ControllerError as problem:
        return [str(problem)]
    if margins.modulus_margin >= task.least_modulus_margin:
        return []
    return [
        f"modulus margin {margins.modulus_margin:.3f} is below the"
        f" {task.least_modulus_margin:g} that the task asks"
    ]


def _by_amplitude(
    task: Task, controller: Controller, sizes: Sequence[float]
) -> tuple[AmplitudeMargins, ...]:
    """Margins of a fuzzy or power law by its describing function."""
    if not controller.gain_varies and controller.has_gain_at_rest:
        return ()
    known, load = task.known_model or task.model, task.loads[0]
    small = fine_amplitudes(task) if controller.has_gain_at_rest else ()
    return (
        *(
            amplitude_margins(controller, known, load, amplitude=a, lowest_Hz=SLOWEST_Hz)
            for a in small
        ),
        *(amplitude_margins(controller, known, load, amplitude=a) for a in sizes),
    )


def fine_amplitudes(task: Task) -> tuple[float, ...]:
    """Amplitudes from a few counts of the encoder that moves up to that of the smallest step."""
    amplitude = largest_amplitude(task.reference)
    smallest = max(COUNTS * moving_count(task), FINEST * amplitude)
    found = np.geomspace(smallest, SHARES[0] * amplitude, AMPLITUDES + 1)[:-1]
    return tuple(float(a) for a in found if a < SHARES[0] * amplitude)


def _swinging(task: Task, by_amplitude: Sequence[AmplitudeMargins]) -> list[str]:
    """What speaks against the loop by its describing function."""
    least_phase_deg = float(np.degrees(2.0 * np.arcsin(0.5 * task.least_modulus_margin)))
    reasons = []
    for found in by_amplitude:
        at = f"at an amplitude of {found.amplitude:.3g} {task.reference.unit} (describing function)"
        if found.phase_margin_deg <= least_phase_deg:
            reasons.append(f"phase margin {found.phase_margin_deg:.1f} deg {at}")
        elif found.modulus_margin < task.least_modulus_margin:
            reasons.append(f"distance {found.modulus_margin:.3f} from -1 {at}")
    return reasons


def moving_count(task: Task) -> float:
    """A count of the encoder that moves, in the unit of what is followed; 0 without encoders.

    With the output held that is the motor's, through the gear; else the load's, the coarser one.
    """
    rig, held = task.model.rig, task.loads[0].is_held
    counts = rig.motor_encoder_counts_per_rev if held else rig.load_encoder_counts_per_rev
    angle = count_angle_rad(counts) if counts else 0.0
    if held:
        angle /= rig.gear_ratio or 1.0
    if task.reference.unit == "Nm":
        angle *= rig.spring_stiffness_Nm_per_rad or 1.0
    return angle


def smallest_swing(task: Task, size: float) -> float:
    """What counts as an oscillation, in the unit of what is followed."""
    return max(COUNTS * moving_count(task), SMALLEST * size)


def _still(task: Task, size: float) -> float:
    """What a loop at rest may still move by after a step of a size."""
    return max(COUNTS * moving_count(task), STILL * size)


def swings_on(task: Task, controllers: Sequence[Controller]) -> list[bool]:
    """Which of many controllers, run side by side, swing on or run away after a middle step."""
    size = SHARES[1] * largest_amplitude(task.reference)
    calm = {"from_s": 0.0, "noise": (0.0, 0.0, 0.0)}
    run_s = max(_run_s(task, c) for c in controllers)
    step = replace(task, reference=_step(task, size), duration_s=run_s, **calm)
    ran = run_all(step, controllers, task.loads[0], with_rows=True)
    column = CHANNELS.index(FOLLOWED[task.reference.unit])
    time = np.linspace(0.0, step.duration_s, ran.rows.shape[1])

    def swings(signal: NDArray) -> bool:
        least = smallest_swing(task, size)
        left = unrest(time, signal, smallest=least, still=_still(task, size))
        moves_on = left is not None and not left.is_dying
        return moves_on or oscillation(time, signal, smallest=least) is not None

    return [
        bool(failed) or swings(rows[:, column])
        for failed, rows in zip(ran.failed, ran.rows, strict=True)
    ]


def _run_s(task: Task, controller: Controller) -> float:
    """How long a loop is watched after a step."""
    slowest = slowest_swing_Hz(task.known_model or task.model, controller, task.loads[0])
    return max(RUN_s, min(SWINGS / slowest, LONGEST_s), 400.0 * controller.sample_time_s)


def _step(task: Task, size: float) -> Reference | AngleReference:
    if task.reference.unit == "Nm":
        return Reference(kind="step", amplitude_Nm=size)
    return AngleReference(kind="step", amplitude_rad=size)


def _after_step(task: Task, controller: Controller, size: float) -> Oscillation | str | None:
    """What is left of a step on the machine without its external torques."""
    run_s, least = _run_s(task, controller), smallest_swing(task, size)
    left = None
    # a slow approach is no swing: what moves at the end of the first run is watched for longer
    for duration_s in (run_s, max(run_s, min(LONGER * run_s, LONGEST_s))):
        try:
            ran = simulate_closed_loop(
                task.model,
                controller,
                _step(task, size),
                task.loads[0],
                duration_s=duration_s,
                refuse_unstable=False,
                known_model=task.known_model,
            )
        except RseaError as problem:
            return " ".join(str(problem).split())
        signal = getattr(ran, FOLLOWED[task.reference.unit])
        if size != 0.0 and not (ran.command.any() and signal.any()):
            return f"its {'response' if ran.command.any() else 'command'} is 0 throughout"
        swing = oscillation(ran.time_s, signal, smallest=least)
        left = unrest(ran.time_s, signal, smallest=least, still=_still(task, size))
        if swing is not None or left is None:
            return swing
    return f"not at rest after {duration_s:.3g} s: moves by {left.moved:.3g} in the last fifth"
