"""A controller and a machine, run together."""

import numpy as np

from rsea_core.control.laws.base import Controller
from rsea_core.control.stability.margins import require_stable
from rsea_core.errors import ControllerError, InputError
from rsea_core.machine.inputs import Load
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.simulation.reference import AngleReference, Reference
from rsea_core.simulation.simulate import run_sampled
from rsea_core.simulation.trajectory import Trajectory

ROW_s = 1e-3
MOST_ROWS = 1e7


def simulate_closed_loop(
    model: ActuatorModel,
    controller: Controller,
    reference: Reference | AngleReference,
    load: Load,
    *,
    duration_s: float,
    row_s: float | None = None,
    initial_motor_angle_rad: float = 0.0,
    initial_load_angle_rad: float = 0.0,
    refuse_unstable: bool = True,
    known_model: ActuatorModel | None = None,
    **how,
) -> Trajectory:
    """What the machine does under a controller, from rest and without current.

    Parameters
    ----------
    row_s : see `rows_per_sample`
    refuse_unstable : bool
        Of the linear analysis; a law whose gain at rest says little is run in any case.
    known_model : ActuatorModel or None
        What the controller is made for, where that is another model than the true one.
    **how : step_s, engine, see `simulate`

    Raises
    ------
    ControllerError
        If the loop is unstable, what is to be followed is not what the controller follows, or
        the sample time is not a whole number of rows.
    RigError, InputError, SimulationError
        As `simulate`.
    """
    _require_fit(controller, reference, load, duration_s, row_s)
    per_sample, row = rows_per_sample(controller.sample_time_s, row_s)
    if refuse_unstable and controller.has_gain_at_rest and not controller.gain_varies:
        require_stable(
            known_model or model, controller, load, load_angle_rad=initial_load_angle_rad
        )
    compiled = controller.compile(known_model or model, load)
    time = np.arange(round(duration_s / row) + 1) * row
    try:
        return run_sampled(
            model,
            command_name=compiled.command_name,
            load=load,
            time_s=time,
            controller=compiled.function,
            parameters=compiled.parameters,
            state=compiled.state,
            reference=reference.sample(time),
            reference_name=controller.reference_name,
            initial_angles_rad=(initial_motor_angle_rad, initial_load_angle_rad),
            rows_per_sample=per_sample,
            delay_samples=controller.delay_samples,
            command_limit=compiled.command_limit,
            **how,
        )
    finally:
        _raise_of_law(controller)


def _raise_of_law(controller: Controller) -> None:
    """What went wrong inside a law that is called in Python: no exception leaves compiled code."""
    problems = getattr(controller, "problems", None)
    if problems:
        first = problems[0]
        problems.clear()
        text = f"{controller.kind}: {type(first).__name__}: {first}"
        raise ControllerError(text) from first


def _require_fit(
    controller: Controller, reference: Reference | AngleReference, load: Load, duration_s: float,
    row_s: float | None,
) -> None:  # fmt: skip
    if not 0.0 < duration_s < np.inf:
        raise InputError(f"duration_s = {duration_s} must be above 0")
    require_samples(controller, reference, duration_s, row_s)
    if load.kind == "imposed":
        raise InputError('a closed loop with the load "imposed" needs its motion: use "locked"')
    if reference.unit not in controller.reference_name:
        raise ControllerError(
            f"{controller.kind} follows {controller.reference_name}, not a reference in"
            f" {reference.unit}"
        )


def require_samples(
    controller: Controller, reference: Reference | AngleReference, duration_s: float,
    row_s: float | None = None,
) -> None:  # fmt: skip
    """Check that a run has a number of rows that fits, and a reference that its samples show.

    Raises
    ------
    InputError
        If there are more than MOST_ROWS, or the reference is not below half the sampling rate.
    """
    row_s = row_s or min(controller.sample_time_s, ROW_s)
    if not duration_s / row_s <= MOST_ROWS:
        raise InputError(
            f"duration_s = {duration_s:g} makes {duration_s / row_s:.3g} rows of {row_s:g} s, at"
            f" most {MOST_ROWS:.0e} are simulated"
        )
    nyquist = 0.5 / controller.sample_time_s
    for name in ("frequency_Hz", "end_frequency_Hz"):
        value = getattr(reference, name, None)
        if value is not None and not value < nyquist:
            raise InputError(
                f"reference {name} = {value:g} is not below half the sampling rate of the law,"
                f" {nyquist:g} Hz"
            )


def rows_per_sample(sample_time_s: float, row_s: float | None) -> tuple[int, float]:
    """Rows between two actions of a controller, and the time between rows.

    A row is a whole fraction of the sample time; None: the largest one up to 1 ms.

    Raises
    ------
    ControllerError
        If the sample time is not a whole number of rows.
    """
    if row_s is None:
        count = int(np.ceil(sample_time_s / ROW_s - 1e-9))
        return max(count, 1), sample_time_s / max(count, 1)
    count = round(sample_time_s / row_s)
    if count < 1 or abs(count * row_s - sample_time_s) > 1e-9 * sample_time_s:
        raise ControllerError(
            f"sample_time_s = {sample_time_s:g} s is not a whole number of rows of {row_s:g} s:"
            f" rows of {sample_time_s / max(count, 1):g} s would do"
        )
    return count, row_s
