"""Figures that judge a closed loop: errors, effort, energy at the port, limit cycles.

Definitions (the thesis' section 4 with the ambiguities settled): RMSE over the judged rows;
steady-state error as the mean error over the last 20 %; controller effect as RMS of the command,
effort as mean absolute change of it from sample to sample. Steps: `simulation/step_response.py`.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rsea_core.control.closed_loop import rows_per_sample
from rsea_core.control.laws.base import Controller
from rsea_core.errors import InputError
from rsea_core.machine.inputs import Load
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.simulation.simulate import run_sampled
from rsea_core.simulation.trajectory import Trajectory

LAST_SHARE = 0.2
CYCLES_NEEDED = 3


@dataclass(frozen=True, kw_only=True)
class Following:
    """How a response follows its reference.

    Attributes
    ----------
    rmse, peak_error, steady_state_error : float
        In the response's unit.
    ise, iae, itae, itse : float
        Integrals of squared and absolute error, and both weighed by time.
    """

    rmse: float
    peak_error: float
    steady_state_error: float
    ise: float
    iae: float
    itae: float
    itse: float


def following(time_s: NDArray, reference: NDArray, response: NDArray) -> Following:
    """Judge a response against its reference, rows evenly spaced.

    Raises
    ------
    InputError
        If there are fewer than 8 rows.
    """
    if time_s.size < 8:
        raise InputError(f"{time_s.size} rows are too few to judge, needs 8")
    t, error = time_s - time_s[0], reference - response
    size, square = np.abs(error), error**2
    last = t >= (1.0 - LAST_SHARE) * t[-1]
    return Following(
        rmse=float(np.sqrt(square.mean())),
        peak_error=float(size.max()),
        steady_state_error=float(error[last].mean()),
        ise=float(np.trapezoid(square, t)),
        iae=float(np.trapezoid(size, t)),
        itae=float(np.trapezoid(t * size, t)),
        itse=float(np.trapezoid(t * square, t)),
    )


@dataclass(frozen=True, kw_only=True)
class LimitCycle:
    """A steady oscillation.

    Attributes
    ----------
    amplitude : float
        Half of peak to peak, in the signal's unit.
    frequency_Hz : float
    """

    amplitude: float
    frequency_Hz: float


def limit_cycle(time_s: NDArray, signal: NDArray, *, smallest: float) -> LimitCycle | None:
    """The oscillation that the last 40 % of a signal keep up, None where there is none.

    It counts as one if at least three periods have the same amplitude within a quarter and that
    is larger than `smallest`, one encoder count for instance. The reference must be at rest.
    """
    rows = time_s >= time_s[0] + 0.6 * (time_s[-1] - time_s[0])
    t, x = time_s[rows], signal[rows] - signal[rows].mean()
    rising = np.flatnonzero((x[:-1] <= 0.0) & (x[1:] > 0.0))
    if rising.size < CYCLES_NEEDED + 1:
        return None
    sizes = [0.5 * np.ptp(x[a : b + 1]) for a, b in pairwise(rising)]
    whole = [s for s in sizes if s > 0.25 * max(sizes)]  # ripples between are not periods
    amplitude = float(np.median(whole))
    if amplitude <= smallest or len(whole) < CYCLES_NEEDED:
        return None
    if np.abs(np.array(whole) - amplitude).max() > 0.25 * amplitude:
        return None
    return LimitCycle(
        amplitude=amplitude, frequency_Hz=float(len(whole) / (t[rising[-1]] - t[rising[0]]))
    )


@dataclass(frozen=True, kw_only=True)
class PortEnergy:
    """What a moving environment gets out of the joint while it swings it.

    Attributes
    ----------
    frequency_Hz : (f,) array
    absorbed_J : (f,) array
        Net energy that the joint takes up in a period; negative: it drives its environment.
    """

    frequency_Hz: NDArray
    absorbed_J: NDArray

    @property
    def is_passive(self) -> bool:
        """Whether no measured frequency got energy out of the joint."""
        return bool((self.absorbed_J >= 0.0).all())


def swung(
    model: ActuatorModel,
    controller: Controller,
    load_amplitude_rad: float,
    frequency_Hz: float,
    periods: int,
) -> Trajectory:
    """The closed loop whose output is swung while it asks for nothing.

    The swing grows during the first period.
    """
    load = Load(kind="imposed")
    compiled = controller.compile(model, load)
    per_sample, row = rows_per_sample(controller.sample_time_s, None)
    time = np.arange(round(periods / frequency_Hz / row) + 1) * row
    growing = np.clip(time * frequency_Hz, 0.0, 1.0)
    swing = load_amplitude_rad * np.sin(2.0 * np.pi * frequency_Hz * time)
    return run_sampled(
        model,
        command_name=compiled.command_name,
        load=load,
        time_s=time,
        controller=compiled.function,
        parameters=compiled.parameters,
        state=compiled.state,
        reference=np.zeros((time.size, 3)),
        reference_name=controller.reference_name,
        load_angle_rad=swing * growing**2 * (3.0 - 2.0 * growing),
        rows_per_sample=per_sample,
        delay_samples=controller.delay_samples,
        command_limit=compiled.command_limit,
    )


def port_energy(
    model: ActuatorModel,
    controller: Controller,
    *,
    load_amplitude_rad: float,
    frequencies_Hz: tuple[float, ...] = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0),
    periods: int = 6,
) -> PortEnergy:
    """Swing the output and measure the energy that the closed loop takes up, per period.

    A passive port cannot destabilise a passive environment (Colgate & Hogan 1988); the measure
    is of the loop as it runs, sampled, quantised and with its friction. The reference is zero.

    Raises
    ------
    InputError
        If amplitude or a frequency are not above 0.
    RseaError
        If model and controller do not go together.
    """
    if not load_amplitude_rad > 0.0 or min(frequencies_Hz) <= 0.0 or periods < 3:
        raise InputError(
            "load_amplitude_rad and frequencies_Hz must be above 0, periods at least 3"
        )
    absorbed = []
    for frequency in frequencies_Hz:
        result = swung(model, controller, load_amplitude_rad, frequency, periods)
        half = result.time_s >= 0.5 * result.time_s[-1]
        work = result.energy.load_work_J[half]
        absorbed.append((work[-1] - work[0]) / (0.5 * periods))
    return PortEnergy(frequency_Hz=np.array(frequencies_Hz), absorbed_J=np.array(absorbed))
