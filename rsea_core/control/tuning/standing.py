"""Whether a loop may be ranked: stable by the judge that fits its law, without an oscillation.

A linear law is judged by the poles and margins of its sampled loop. A fuzzy table or a power law
has other gains at other amplitudes, and a contact or a dry joint is no linear machine, so that
every loop is also run: steps of three amplitudes on the engine with located events, each of which
must come to rest. For fuzzy and power laws the describing function gives the margins at those
amplitudes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rsea_core.control.closed_loop import simulate_closed_loop
from rsea_core.control.laws.base import Controller
from rsea_core.control.stability.describing_functions import AmplitudeMargins, amplitude_margins
from rsea_core.control.stability.margins import LoopMargins, loop_margins, require_stable
from rsea_core.control.stability.oscillation import Oscillation, oscillation
from rsea_core.control.tuning.tune_task import FOLLOWED, Task, run_all
from rsea_core.engines.fixed_step.layout import CHANNELS
from rsea_core.errors import ControllerError, RseaError
from rsea_core.machine.quantities import count_angle_rad
from rsea_core.simulation.reference import AngleReference, Reference, largest_amplitude

SHARES = (0.1, 0.5, 1.0)  # of the task's own amplitude
RUN_s = 2.0
COUNTS = 3.0  # of the encoders: a smaller oscillation is their resolution
SMALLEST = 0.01  # of the task's amplitude


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
        By the describing function, for fuzzy and power laws.
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
    linear = torque and controller.has_gain_at_rest
    margins = loop_margins(known, controller, load) if linear else None
    nonlinear = controller.gain_varies or not controller.has_gain_at_rest
    amplitude = largest_amplitude(task.reference)
    sizes = tuple(share * amplitude for share in SHARES)
    by_amplitude = ()
    if nonlinear:
        by_amplitude = tuple(amplitude_margins(controller, known, load, amplitude=a) for a in sizes)
    reasons = []
    if margins is not None and not nonlinear:
        try:
            require_stable(known, controller, load)
            if margins.modulus_margin < task.least_modulus_margin:
                reasons.append(
                    f"modulus margin {margins.modulus_margin:.3f} is below the"
                    f" {task.least_modulus_margin:g} that the task asks"
                )
        except ControllerError as problem:
            reasons.append(str(problem))
    least_phase_deg = float(np.degrees(2.0 * np.arcsin(0.5 * task.least_modulus_margin)))
    for found in by_amplitude:
        if found.phase_margin_deg <= least_phase_deg:
            reasons.append(
                f"phase margin {found.phase_margin_deg:.1f} deg at an amplitude of"
                f" {found.amplitude:.3g} {task.reference.unit} (describing function)"
            )
    swings = []
    for size in sizes:
        swing = _after_step(task, controller, size)
        if isinstance(swing, str):
            reasons.append(f"step of {size:.3g} {task.reference.unit}: {swing}")
        elif swing is not None:
            swings.append((size, swing))
            reasons.append(f"{swing} {task.reference.unit} after a step of {size:.3g}")
    return Standing(
        reasons=tuple(reasons),
        margins=margins,
        by_amplitude=by_amplitude,
        oscillations=tuple(swings),
    )


def smallest_swing(task: Task, size: float) -> float:
    """What counts as an oscillation, in the unit of what is followed."""
    rig = task.model.rig
    count = rig.load_encoder_counts_per_rev
    angle = 0.0 if count is None else count_angle_rad(count)
    if task.reference.unit == "Nm":
        angle *= rig.spring_stiffness_Nm_per_rad or 1.0
    return max(COUNTS * angle, SMALLEST * size)


def swings_on(task: Task, controllers: Sequence[Controller]) -> list[bool]:
    """Which of many controllers, run side by side, swing on after a step of middle size."""
    size, run_s = SHARES[1] * largest_amplitude(task.reference), _run_s(controllers[0])
    calm = {"from_s": 0.0, "noise": (0.0, 0.0, 0.0)}
    step = replace(task, reference=_step(task, size), duration_s=run_s, **calm)
    ran = run_all(step, controllers, task.loads[0], with_rows=True)
    column = CHANNELS.index(FOLLOWED[task.reference.unit])
    time = np.linspace(0.0, step.duration_s, ran.rows.shape[1])
    least = smallest_swing(task, size)
    return [
        bool(failed) or oscillation(time, rows[:, column], smallest=least) is not None
        for failed, rows in zip(ran.failed, ran.rows, strict=True)
    ]


def _run_s(controller: Controller) -> float:
    return max(RUN_s, 400.0 * controller.sample_time_s)


def _step(task: Task, size: float) -> Reference | AngleReference:
    if task.reference.unit == "Nm":
        return Reference(kind="step", amplitude_Nm=size)
    return AngleReference(kind="step", amplitude_rad=size)


def _after_step(task: Task, controller: Controller, size: float) -> Oscillation | str | None:
    """What is left of a step on the machine without its external torques."""
    try:
        ran = simulate_closed_loop(
            task.model,
            controller,
            _step(task, size),
            task.loads[0],
            duration_s=_run_s(controller),
            refuse_unstable=False,
            known_model=task.known_model,
        )
    except RseaError as problem:
        return " ".join(str(problem).split())
    signal = getattr(ran, FOLLOWED[task.reference.unit])
    return oscillation(ran.time_s, signal, smallest=smallest_swing(task, size))
