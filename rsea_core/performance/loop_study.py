"""What a closed torque or angle loop does beside its task: step, port, limit cycles, fuzzy table.

The port is what a load feels: minus the spring's torque over the load's speed, with a reference of
zero. Where its real part is not negative at any frequency, the machine cannot destabilise a
passive load (Colgate & Hogan 1988, Int. J. Control 48(1)). It is the linear sampled loop's, at
its samples.

The limit cycles are those that additional delay of the command would start. The describing
function gives for each amplitude the delay that uses up the phase margin, and the frequency of
the gain crossover; runs with whole samples of delay, from a wound spring, are put against it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.control.closed_loop import simulate_closed_loop
from rsea_core.control.laws.base import Controller
from rsea_core.control.laws.fuzzy_torque import FuzzyTorque
from rsea_core.control.stability.describing_functions import harmonic_loop
from rsea_core.control.stability.margins import (
    LoopMargins,
    loop_margins,
    open_loop_response,
    port_impedance,
)
from rsea_core.control.stability.oscillation import oscillation
from rsea_core.effects.drive_delay import DriveDelay
from rsea_core.errors import RseaError
from rsea_core.machine.inputs import Load
from rsea_core.machine.spring_table import spring_tangent_Nm_per_rad
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.simulation.reference import AngleReference, Reference

STEP_SHARE, RUN_s = 0.5, 1.5  # of the amplitude that is asked for; of every run
SLOWEST_Hz, PLOTTED, PORT_POINTS = 0.1, 400, 80
AMPLITUDES, FREQUENCIES = 9, 60  # of the describing function
SMALLEST, LARGEST = 0.02, 2.0  # of the amplitude that is asked for
MOST_DELAYS, PERIODS, LONGEST_s = 5, 24.0, 16.0
SURFACE = 41  # points of a fuzzy table in each direction


@dataclass(frozen=True, kw_only=True)
class Cycle:
    """A limit cycle with some additional delay: amplitude [Nm], frequency [Hz]."""

    delay_s: float
    amplitude: float
    frequency_Hz: float


@dataclass(frozen=True, kw_only=True)
class LoopStudy:
    """What a loop does beside its task; None for what it does not have.

    Attributes
    ----------
    name : str
    unit : "Nm" or "rad"
        Of what it follows.
    step_height : float
    step : ((n,), (n,), (n,)) arrays or None
        Time, response and command after a step of that height at 0 s; None where it cannot run.
    margins : LoopMargins or None
    open_loop, port : ((f,), (f,)) arrays or None
        Frequency and complex value: of the loop broken at the command; of the port [Nms/rad], None
        where the loop is unstable with its load held.
    predicted, bare, whole : tuple of Cycle
        Limit cycles by the describing function; of runs of the machine without its effects, and
        with them.
    surface : ((a,), (b,), (b, a)) arrays or None
        Error [Nm], its rate [Nm/s] and a fuzzy table's answer in per cent of the command.
    """

    name: str
    unit: str
    step_height: float
    step: tuple[NDArray, NDArray, NDArray] | None
    margins: LoopMargins | None
    open_loop: tuple[NDArray, NDArray] | None
    port: tuple[NDArray, NDArray] | None
    predicted: tuple[Cycle, ...]
    bare: tuple[Cycle, ...]
    whole: tuple[Cycle, ...]
    surface: tuple[NDArray, NDArray, NDArray] | None

    @property
    def active_from_Hz(self) -> float | None:
        """Lowest frequency at which the port's real part is below 0; None where there is none."""
        if self.port is None or self.port[1].real.min() >= 0.0:
            return None
        return float(self.port[0][np.argmax(self.port[1].real < 0.0)])


def loop_study(
    name: str,
    model: ActuatorModel,
    controller: Controller,
    load: Load,
    amplitude: float,
    known_model: ActuatorModel | None = None,
) -> LoopStudy:
    """Study a loop around rest.

    Parameters
    ----------
    amplitude : float
        Of its task [Nm, or rad for a controller of the angle].
    known_model : ActuatorModel or None
        What the controller is made for, where that is another model than the true one.

    Raises
    ------
    RseaError
        If controller and machine do not go together.
    """
    known = known_model or model
    torque = controller.reference_name == "reference_torque_Nm"
    linear = torque and controller.has_gain_at_rest
    f = np.geomspace(SLOWEST_Hz, 0.5 / controller.sample_time_s, PLOTTED)
    low = np.geomspace(SLOWEST_Hz, 0.45 / controller.sample_time_s, PORT_POINTS)
    height = STEP_SHARE * amplitude
    predicted = _predicted(known, controller, load, amplitude) if torque else ()
    port = port_impedance(known, controller, low) if linear else None
    bare = ActuatorModel(model.rig, tuple(t for t in model.terms if t.in_spring_table))
    runs = [
        _cycles(machine, controller, load, amplitude, known, predicted) for machine in (bare, model)
    ]
    return LoopStudy(
        name=name,
        unit="Nm" if torque else "rad",
        step_height=height,
        step=_step(model, controller, load, height, known),
        margins=loop_margins(known, controller, load) if linear else None,
        open_loop=(f, open_loop_response(known, controller, load, f)) if linear else None,
        port=None if port is None else (low, port),
        predicted=predicted,
        bare=runs[0],
        whole=runs[1] if len(bare.terms) < len(model.terms) else (),
        surface=_surface(controller) if isinstance(controller, FuzzyTorque) else None,
    )


def _step(model, controller, load, height, known) -> tuple[NDArray, NDArray, NDArray] | None:
    torque = controller.reference_name == "reference_torque_Nm"
    reference = (
        Reference(kind="step", amplitude_Nm=height)
        if torque
        else AngleReference(kind="step", amplitude_rad=height)
    )
    try:
        run = simulate_closed_loop(
            model, controller, reference, load,
            duration_s=RUN_s, refuse_unstable=False, known_model=known,
        )  # fmt: skip
    except RseaError:
        return None
    return run.time_s, run.torque_Nm if torque else run.load_angle_rad, run.command


def _predicted(model, controller, load, amplitude) -> tuple[Cycle, ...]:
    """The limit cycle of each amplitude with the shortest delay that starts one, if any."""
    found = []
    f = np.geomspace(0.5, 0.45 / controller.sample_time_s, FREQUENCIES)
    for size in np.geomspace(SMALLEST * amplitude, LARGEST * amplitude, AMPLITUDES):
        loop = harmonic_loop(controller, model, load, amplitude=float(size), frequencies_Hz=f)
        gain, angle = np.log(np.abs(loop)), np.unwrap(np.angle(loop))
        own = []
        for j in np.flatnonzero(np.diff(np.sign(gain)) != 0):
            share = gain[j] / (gain[j] - gain[j + 1])
            at = f[j] * (f[j + 1] / f[j]) ** share
            phase = angle[j] + share * (angle[j + 1] - angle[j])
            left = np.mod(phase + np.pi, 2.0 * np.pi)
            own.append(Cycle(delay_s=float(left / (2.0 * np.pi * at)), amplitude=float(size),
                             frequency_Hz=float(at)))  # fmt: skip
        if own:
            found.append(min(own, key=lambda cycle: cycle.delay_s))
    return tuple(found)


def _cycles(model, controller, load, amplitude, known, predicted) -> tuple[Cycle, ...]:
    """What swings on in runs with whole samples of delay, each a predicted one rounded up."""
    T, found = controller.sample_time_s, []
    asked = {int(np.ceil(c.delay_s / T)): c for c in reversed(predicted)}
    chosen = np.unique(np.linspace(0, len(asked) - 1, MOST_DELAYS).round().astype(int))
    for samples, near in [sorted(asked.items())[j] for j in chosen] if asked else []:
        try:
            run = simulate_closed_loop(
                model.with_terms(DriveDelay(delay_s=samples * T)) if samples else model,
                controller, Reference(kind="step", amplitude_Nm=0.0), load,
                duration_s=float(np.clip(PERIODS / near.frequency_Hz, RUN_s, LONGEST_s)),
                initial_motor_angle_rad=_wound(model, load, STEP_SHARE * amplitude),
                refuse_unstable=False, known_model=known,
            )  # fmt: skip
        except RseaError:
            continue
        swing = oscillation(run.time_s, run.torque_Nm, smallest=0.5 * SMALLEST * amplitude)
        if swing is not None:
            found.append(Cycle(delay_s=samples * T, amplitude=swing.amplitude,
                               frequency_Hz=swing.frequency_Hz))  # fmt: skip
    return tuple(found)


def _wound(model: ActuatorModel, load: Load, torque_Nm: float) -> float:
    """Motor angle that winds the spring to a torque, by its tangent at zero [rad]."""
    tangent = float(spring_tangent_Nm_per_rad(model.spring_table(load), 0.0))
    return torque_Nm / tangent * (model.rig.gear_ratio or 1.0)


def _surface(controller: FuzzyTorque) -> tuple[NDArray, NDArray, NDArray]:
    system = controller.system()
    errors = np.linspace(system.first.min(), system.first.max(), SURFACE)
    rates = np.linspace(system.second.min(), system.second.max(), SURFACE)
    answer = system.evaluate(-errors[None, :], -rates[:, None])
    factors = controller.error_scale_per_Nm, controller.rate_scale_s_per_Nm
    return (
        errors / max(factors[0], 1e-12),
        rates / max(factors[1], 1e-12),
        2.0 * controller.output_scale * (answer - 50.0),
    )
