"""The figures of the thesis' Table 2.1, each with its definition and whether it can be.

`performance_table` works every row out for a machine; step, cycle and zero-torque rows come from
simulations that it is given or runs. What "possible" means: the nominal machine (lossless gear,
linear around rest, locked output) can do what the thesis states; "conditional" says on what it
hangs; "not checkable" that the thesis does not state enough.
"""

import math
from dataclasses import dataclass

from rsea_core.control.laws.base import Controller
from rsea_core.errors import InputError
from rsea_core.machine.inputs import Load
from rsea_core.machine.quantities import count_angle_rad
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.performance.bandwidth import (
    SQUARE_WAVE,
    amplitude_limits,
    published_bandwidth_Hz,
    torque_bandwidth,
)
from rsea_core.performance.efficiency import CycleEfficiency
from rsea_core.performance.frequency import natural_frequencies
from rsea_core.performance.zero_impedance import (
    largest_followed_swing_rad,
    zero_impedance_torque_Nm,
)
from rsea_core.simulation.step_response import StepMetrics

LOCKED = Load(kind="locked")
STATED_BANDWIDTHS = (  # amplitude, frequency, where
    (45.0, 5.0, "goal of Table 2.1"),
    (20.8, 0.1, "section 2.1"),
    (20.8, published_bandwidth_Hz(20.8), "fit of Figure 2.18"),
    (7.0, published_bandwidth_Hz(7.0), "fit of Figure 2.18"),
)
ROUNDED = 1.02  # 0.0505 Nm is printed as 0.05
HAND_SWING_rad, HAND_SWING_Hz = 0.1, 1.0  # a hand that moves the joint
POSSIBLE, IMPOSSIBLE = "possible", "impossible"
CONDITIONAL, NOT_CHECKABLE = "conditional", "not checkable"


@dataclass(frozen=True, kw_only=True)
class PerformanceRow:
    """One figure of the actuator.

    Attributes
    ----------
    name, definition : str
    value : float or None
        In `unit`; None where the machine's data do not tell.
    unit : str
    thesis : float or None
        What the thesis states for it, in the same unit.
    verdict : str
        "possible", "impossible", "conditional" or "not checkable": the thesis' number on this
        machine.
    why : str
    """

    name: str
    definition: str
    value: float | None
    unit: str
    thesis: float | None
    verdict: str
    why: str


def performance_table(
    model: ActuatorModel,
    *,
    continuous_current_A: float | None = None,
    gear_efficiency: float = 1.0,
    controller: Controller | None = None,
    step: StepMetrics | None = None,
    cycle: CycleEfficiency | None = None,
) -> tuple[PerformanceRow, ...]:
    """Every figure of Table 2.1 and of section 2.1 for one machine.

    Parameters
    ----------
    continuous_current_A : float or None
        DC-equivalent; 1.73 A is what the thesis' motor is rated for.
    gear_efficiency : float
        Of a worm from motor to output, 0 to 1, for the torques at rest only.
    controller : Controller or None
        With it the zero-impedance torque is simulated.
    step, cycle : StepMetrics, CycleEfficiency or None
        With them the rows of settling and efficiency are there.

    Raises
    ------
    InputError
        If the gear efficiency is not above 0 and at most 1.
    RseaError
        If the rig lacks a value of its electric drive, gear or spring.
    """
    if not 0.0 < gear_efficiency <= 1.0:
        raise InputError(f"gear_efficiency = {gear_efficiency} must be above 0 and at most 1")
    model.rig.need(
        "the performance table",
        "current_limit_A",
        "load_encoder_counts_per_rev",
        "supply_voltage_V",
    )
    rows = [
        *_torque_rows(model, continuous_current_A, gear_efficiency),
        _speed_row(model, continuous_current_A),
        *(_bandwidth_row(model, *stated) for stated in STATED_BANDWIDTHS),
        *_fifteen_hertz_rows(model),
        *_resolution_rows(model),
        *_zero_impedance_rows(model, controller),
        _stiffness_row(model),
        PerformanceRow(
            name="maximal mass",
            definition="mass of the actuator",
            value=None,
            unit="kg",
            thesis=3.5,
            verdict=NOT_CHECKABLE,
            why="a rig file holds no masses of the actuator itself",
        ),
    ]
    if step is not None:
        rows += _step_rows(step)
    if cycle is not None:
        rows += _efficiency_rows(cycle)
    return tuple(rows)


def _torque_rows(model, continuous_current_A, gear_efficiency) -> list[PerformanceRow]:
    rest = amplitude_limits(model, 1e-3)
    plant = model.plant("duty", LOCKED)
    peak = plant.torque_per_ampere * plant.current_limit * gear_efficiency
    usable = min(peak, rest.contact_Nm)
    verdict, why = POSSIBLE, f"the current limit allows {peak:.3g} Nm"
    if peak < 20.0:
        verdict = IMPOSSIBLE
    elif rest.contact_Nm < 20.0:
        verdict = CONDITIONAL
        why += f", but the spring's curve is known up to {rest.contact_Nm:.3g} Nm only: contact"
    found = [
        PerformanceRow(
            name="peak torque",
            definition="N k_t i_max eta_gear, at most the end of the spring's valid range",
            value=usable,
            unit="Nm",
            thesis=20.0,
            verdict=verdict,
            why=why,
        )
    ]
    if continuous_current_A is not None:
        steady = plant.torque_per_ampere * continuous_current_A * gear_efficiency
        found.append(
            PerformanceRow(
                name="continuous torque",
                definition="N k_t i_continuous eta_gear: limited by heating, without time limit",
                value=steady,
                unit="Nm",
                thesis=20.0,
                verdict=POSSIBLE if steady >= 20.0 else IMPOSSIBLE,
                why=f"{continuous_current_A:g} A and a gear efficiency of {gear_efficiency:g}",
            )
        )
    return found


def _speed_row(model, continuous_current_A) -> PerformanceRow:
    rig, plant = model.rig, model.plant("duty", LOCKED)
    current = continuous_current_A or 0.0
    speed = (rig.supply_voltage_V - plant.resistance * current) / plant.volts_per_speed
    at = "no load" if not current else f"{current:g} A"
    return PerformanceRow(
        name="output speed",
        definition="(V - R i_continuous) / (N k_e); without a rating at no load",
        value=speed,
        unit="rad/s",
        thesis=1.2,
        verdict=POSSIBLE if speed >= 1.2 else IMPOSSIBLE,
        why=f"{speed:.3g} rad/s at {at}",
    )


def _bandwidth_row(model, amplitude_Nm, wanted_Hz, stated) -> PerformanceRow:
    found = torque_bandwidth(model, amplitude_Nm)
    reached = found.frequency_Hz >= wanted_Hz
    only_square = not reached and found.square_wave_Hz >= wanted_Hz
    verdict = POSSIBLE if reached else CONDITIONAL if only_square else IMPOSSIBLE
    return PerformanceRow(
        name=f"large torque bandwidth at {amplitude_Nm:g} Nm",
        definition="highest frequency of a sine of this amplitude on a locked output that reaches"
        " neither voltage limit, current limit nor the end of the spring's range",
        value=found.frequency_Hz,
        unit="Hz",
        thesis=wanted_Hz,
        verdict=verdict,
        why=f"{stated}; {found.binding} binds;"
        f" at most {found.square_wave_Hz:.3g} Hz with a square wave",
    )


def _fifteen_hertz_rows(model) -> list[PerformanceRow]:
    limits = amplitude_limits(model, 15.0)
    bang_bang = min(limits.supply_Nm, limits.current_Nm) * SQUARE_WAVE
    bang_bang = min(bang_bang, limits.contact_Nm)
    found = []
    for name, share in (("torque amplitude", 1.0), ("peak-to-peak torque", 2.0)):
        value, best = share * limits.largest_Nm, share * bang_bang
        at_3dB = best >= 7.0 / math.sqrt(2.0)
        verdict = POSSIBLE if value >= 7.0 else CONDITIONAL if at_3dB else IMPOSSIBLE
        found.append(
            PerformanceRow(
                name=f"{name} at 15 Hz",
                definition="largest undistorted sine on a locked output",
                value=value,
                unit="Nm",
                thesis=7.0,
                verdict=verdict,
                why=f"{limits.binding} binds; {best:.3g} Nm with a square wave"
                + (", enough at -3 dB" if verdict == CONDITIONAL else ""),
            )
        )
    return found


def _resolution_rows(model) -> list[PerformanceRow]:
    step = _count_torque_Nm(model)
    return [
        PerformanceRow(
            name="torque resolution",
            definition="K times one count of the load encoder",
            value=step,
            unit="Nm",
            thesis=goal,
            verdict=POSSIBLE if step <= goal * ROUNDED else IMPOSSIBLE,
            why=f"{model.rig.load_encoder_counts_per_rev:g} counts per turn; {origin}",
        )
        for goal, origin in ((0.1, "the goal of Table 2.1"), (0.05, "stated with Figure 2.19"))
    ]


def _count_torque_Nm(model) -> float:
    stiffness = natural_frequencies(model).stiffness_Nm_per_rad
    return stiffness * count_angle_rad(model.rig.load_encoder_counts_per_rev)


def _zero_impedance_rows(model, controller) -> list[PerformanceRow]:
    floor, plant = 2.0 * _count_torque_Nm(model), model.plant("duty", LOCKED)
    no_load = plant.volts_per_command / plant.volts_per_speed
    value, definition = floor, "two encoder counts, peak to peak: the limit of any loop"
    why = f"the floor is {floor:.3g} Nm; only while the load moves slower than {no_load:.3g} rad/s"
    if controller is not None:
        value = zero_impedance_torque_Nm(
            model, controller, load_amplitude_rad=HAND_SWING_rad, frequency_Hz=HAND_SWING_Hz
        )
        definition = (
            f"peak-to-peak torque while the output is swung by {HAND_SWING_rad:g} rad at"
            f" {HAND_SWING_Hz:g} Hz and none is asked for, simulated"
        )
        why += "; this controller meets it" if value <= 0.3 else "; this controller misses it"
    swing = largest_followed_swing_rad(model, 15.0)
    return [
        PerformanceRow(
            name="zero-impedance torque",
            definition=definition,
            value=value,
            unit="Nm",
            thesis=0.3,
            verdict=CONDITIONAL if floor <= 0.3 else IMPOSSIBLE,
            why=why,
        ),
        PerformanceRow(
            name="zero-impedance swing at 15 Hz",
            definition="largest load amplitude that the motor can follow at the stated bandwidth",
            value=swing,
            unit="rad",
            thesis=None,
            verdict=CONDITIONAL,
            why=f"15 Hz holds for swings up to {swing:.3g} rad; the thesis states no amplitude",
        ),
    ]


def _stiffness_row(model) -> PerformanceRow:
    found = natural_frequencies(model)
    K = found.stiffness_Nm_per_rad
    return PerformanceRow(
        name="spring stiffness",
        definition="tangent of the spring's curve at zero deflection",
        value=K,
        unit="Nm/rad",
        thesis=65.0,
        verdict=POSSIBLE if abs(K - 65.0) <= 0.05 * 65.0 else CONDITIONAL,
        why=f"{K / 65.0 - 1.0:+.1%}; natural frequency {found.locked_Hz:.3g} Hz, output locked",
    )


def _step_rows(step: StepMetrics) -> list[PerformanceRow]:
    why = "the thesis states amplitude, load and gains of its runs incompletely"
    rows = (
        (
            "settling time",
            "from the step until within 2 % of it around the reference",
            step.settling_s,
            "s",
        ),
        (
            "overshoot",
            "largest torque beyond the final mean, of the step",
            step.overshoot_percent,
            "%",
        ),
        (
            "steady-state error",
            "mean of reference less torque over the last 20 %",
            step.steady_state_error_Nm,
            "Nm",
        ),
    )
    return [
        PerformanceRow(
            name=name,
            definition=definition,
            value=value,
            unit=unit,
            thesis=None,
            verdict=NOT_CHECKABLE,
            why=why,
        )
        for name, definition, value, unit in rows
    ]


def _efficiency_rows(cycle: CycleEfficiency) -> list[PerformanceRow]:
    rows = (
        ("driving", "delivered to the load of drawn from the supply", cycle.forward, 58.94),
        ("driven", "net to the supply of net from the load", cycle.backward, None),
        ("net", "net output of net input", cycle.net, None),
        ("throughput", "all that came out of all that went in", cycle.throughput, None),
        ("motor alone", "what equation 2.38 means, as energies", cycle.motor, None),
    )
    return [
        PerformanceRow(
            name=f"efficiency, {name}",
            definition=definition,
            value=None if value is None else 100.0 * value,
            unit="%",
            thesis=thesis,
            verdict=NOT_CHECKABLE,
            why="no energy flows this way in the cycle"
            if value is None
            else "the thesis states neither cycle nor load of its 58.94 %",
        )
        for name, definition, value, thesis in rows
    ]
