"""The motor that warms up: winding and case, acting on resistance and torque constant."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numba import njit

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.slots import slots
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import PLANT, Law, RunConditions, TrialMachine, Unknown, Values
from rsea_core.machine.rig import Rig

WINDING_CAPACITY = slots("winding_heat_capacity", internal=True)
(
    WINDING_TO_CASE,
    CASE_CAPACITY,
    CASE_TO_AMBIENT,
    RESISTANCE_RISE,
    CONSTANT_FALL,
    CONSTANT_FALL_WINDING,
    START_WINDING,
    START_CASE,
) = slots(
    "winding_to_case",
    "case_heat_capacity",
    "case_to_ambient",
    "resistance_rise",
    "torque_constant_fall",
    "torque_constant_fall_by_winding",
    "start_winding_rise",
    "start_case_rise",
)


@njit(error_model="numpy", inline="always")
def magnet_factor(fx, case_rise, winding_rise):
    """Factor on k_t and k_e alike: magnets follow the case, those of a rotor the winding too."""
    return 1.0 - fx[CONSTANT_FALL] * case_rise - fx[CONSTANT_FALL_WINDING] * winding_rise


COPPER_per_K = 3.93e-3  # IEC 60028, of the resistance at 20 C


CASE_J_per_K = 500.0  # of a case whose law does not say
CASE_TO_AIR_W_per_K = 0.5
TOLERANCE_K = 0.5  # a case that is cooler than expected by less is as warm as the session left it
LONGEST_s = 1e5


@njit(cache=True, error_model="numpy")
def initial_rises(past, resistance, capacity, across, case, pause_s):
    """Rise of winding and case [K] after all that a motor has done, from cold.

    Parameters
    ----------
    past : (n, 2) array
        Stretches of time [s] and the mean squared current in each [A^2]; a length below zero is
        the pause between two recordings, whose length is not known.
    resistance : of the cold winding [ohm]
    capacity, across, case : winding [J/K], winding to case [W/K], case [J/K]
    """
    winding, warm = 0.0, 0.0
    for row in range(past.shape[0]):
        length, heat, pieces = past[row, 0], past[row, 1] * resistance, 1
        if length < 0.0:
            length, pieces = pause_s, 40
        h = length / pieces
        decay = np.exp(-h * across / capacity)
        for _ in range(pieces):
            settled = warm + heat * (1.0 + COPPER_per_K * winding) / across
            after = settled + (winding - settled) * decay
            flow = across * (0.5 * (winding + after) - warm)
            warm += h * (flow - CASE_TO_AIR_W_per_K * warm) / case
            winding = after
    return winding, warm


def rested(
    initial_rises_K: tuple[float, float],
    expected_K: float,
    capacity: float,
    across: float,
    case: float,
    pause_s: float,
) -> tuple[float, float]:
    """Rise of winding and case [K] when a further recording begins, `told_K` of the case known.

    The motor rested after the session for as long as between its recordings; longer where the
    case has become cooler than that.

    Parameters
    ----------
    initial_rises_K : (float, float)
        Winding and case when the last recording ended.
    capacity, across, case : as `initial_rises`
    """
    times = np.append(pause_s, np.geomspace(max(pause_s, 1e-3), LONGEST_s, 400)[1:])
    winding, warm = cooled(initial_rises_K, capacity, across, case, times)
    cool = np.flatnonzero(warm <= expected_K + TOLERANCE_K)
    at = int(cool[0]) if cool.size else -1
    return float(winding[at]), float(warm[at])


def cooled(initial_rises_K, capacity: float, across: float, case: float, times) -> tuple:
    """Rises (n,) of winding and case after resting for times [s] without current. Exact."""
    rates = np.array(
        [
            [-across / capacity, across / capacity],
            [across / case, -(across + CASE_TO_AIR_W_per_K) / case],
        ]
    )
    values, vectors = np.linalg.eig(rates)
    parts = vectors * np.linalg.solve(vectors, np.asarray(initial_rises_K, dtype=float))
    after = np.exp(np.outer(times, values)) @ parts.T
    return after[:, 0], after[:, 1]


MAGNETS_per_K = 1.1e-3  # NdFeB
# of a temperature that their weakening alone shows: 0.0005 to 0.002 per kelvin, of any material
MAGNETS_SPREAD = 0.4
START_TIMES = (0.1, 0.4, 1.5)  # of the longest recording
START_RISE_K = 10.0
CASE_PER_WINDING = 60.0  # heat capacities, where nothing is known of the case
WEAKER_per_K = 2e-3  # magnets that warm with the winding: of ferrite, the weakest


def _write(v: Values, d: TrialMachine, w: RunConditions) -> None:
    """Winding and case warm, and stay so from one recording to the next; copper, magnets follow."""
    capacity = v["winding_heat_capacity_J_per_K"]
    across, case = capacity / v["winding_time_s"], v.get("case_heat_capacity_J_per_K", CASE_J_per_K)
    pause_s = v.get("pause_s", 10.0)
    d.put(WINDING_CAPACITY, capacity)
    d.put(WINDING_TO_CASE, across)
    d.put(CASE_CAPACITY, case)
    d.put(CASE_TO_AMBIENT, CASE_TO_AIR_W_per_K)
    d.put(RESISTANCE_RISE, COPPER_per_K)
    d.put(CONSTANT_FALL_WINDING, v.get("torque_constant_fall_per_winding_K", 0.0))
    if w.initial_rises_K is None:
        resistance = d.plant[PLANT["resistance"]] or 1.0
        winding, warm = initial_rises(w.past, resistance, capacity, across, case, pause_s)
    else:
        winding, warm = rested(w.initial_rises_K, w.case_rise_K, capacity, across, case, pause_s)
    measured = w.case_rise_K if w.case_rise_K > 0.0 else warm
    d.put(START_WINDING, measured + winding - warm)
    d.put(START_CASE, measured)
    if d.plant[PLANT["resistance"]] == 0.0:  # of a regulated current: any, the capacity is its
        d.plant[PLANT["resistance"]] = 1.0


def _parameters(v: Values, rig: Rig) -> Values:
    """A heat flow for a time constant; how long the motor rested is the recordings'."""
    capacity = v["winding_heat_capacity_J_per_K"]
    given = {
        "winding_heat_capacity_J_per_K": capacity,
        "winding_to_case_W_per_K": capacity / v["winding_time_s"],
        "resistance_rise_per_K": COPPER_per_K,
    }
    pauses = ("winding_time_s", "pause_s")
    return given | {k: x for k, x in v.items() if k not in (*pauses, *given)}


def _of_a_bench_motor() -> tuple[tuple[Unknown, ...], tuple[tuple[float, ...], ...]]:
    """Unknowns and starts for motors of some hundred grams."""
    unknowns = (
        Unknown(name="winding_heat_capacity_J_per_K", unit="J/K", low=0.5, high=2000.0,
                scale=0.2, log=True),
        Unknown(name="winding_time_s", unit="s", low=0.5, high=1000.0, scale=0.3, log=True,
                prior=1.0),
        Unknown(name="pause_s", unit="s", low=0.01, high=1e5, scale=0.4, log=True, prior=2.0),
    )  # fmt: skip
    return unknowns, ((30.0, 20.0, 10.0), (8.0, 20.0, 10.0), (8.0, 5.0, 3.0))


def _by_the_machine(
    typical: TypicalMagnitudes,
) -> tuple[tuple[Unknown, ...], tuple[tuple[float, ...], ...]]:
    """Unknowns and starts by the heat and the duration of the recordings."""
    resistance = (typical.rig and typical.rig.terminal_resistance_ohm) or 1.0
    heat = resistance * typical.current_A**2
    longest = max((span for _, span in typical.spans.values()), default=10.0)
    times = [share * longest for share in START_TIMES]
    capacities = [heat * time / START_RISE_K for time in times]
    case = max(CASE_PER_WINDING * capacities[-1], CASE_J_per_K)
    unknowns = (
        Unknown(name="winding_heat_capacity_J_per_K", unit="J/K", low=1e-3 * capacities[0],
                high=1e3 * capacities[-1], scale=0.2, log=True),
        Unknown(name="winding_time_s", unit="s", low=0.02 * longest, high=100.0 * longest,
                scale=0.3, log=True, prior=1.0),
        Unknown(name="pause_s", unit="s", low=0.01, high=1e5, scale=0.4, log=True, prior=2.0),
        Unknown(name="case_heat_capacity_J_per_K", unit="J/K", low=case, high=case, scale=0.0),
    )  # fmt: skip
    return unknowns, tuple((c, t, 10.0, case) for c, t in zip(capacities, times, strict=True))


@dataclass(frozen=True, kw_only=True)
class DriveThermal(Term):
    """Two heat capacities warmed by R i^2: the winding, and the case with the magnets.

    C_w h_w' = R i^2 - G_wc (h_w - h_c),  C_c h_c' = G_wc (h_w - h_c) - G_ca h_c, rises h over the
    ambient; R = R_0 (1 + alpha h_w), and k_t and k_e fall by beta_c h_c + beta_w h_w alike: magnets
    at the case, or on a rotor that the winding warms. The rig's values are those at ambient
    temperature.

    Source
    ------
    Two-body model of motor data sheets: Maxon, Key information on DC motors; copper: IEC 60028.
    """

    effect: ClassVar[str] = "drive-thermal"
    law: ClassVar[str] = "winding-and-case"
    port: ClassVar[Port] = Port.DRIVE
    headline: ClassVar[str] = "The motor's parameters change with the temperature of its winding."
    figure_units: ClassVar[Mapping[str, str]] = {
        "resistance_rise_fraction": "-",
        "peak_winding_C": "C",
    }
    form_spread: ClassVar[float] = 0.06  # magnets may weaken by 0 to 0.1 % per K as well

    winding_heat_capacity_J_per_K: float = parameter(
        unit="J/K",
        bounds=(1e-12, 1e9),
        source="385 J/(kg K) times the copper's mass; a fit",
        meaning="Heat that warms the winding by 1 K.",
    )
    winding_to_case_W_per_K: float = parameter(
        unit="W/K",
        bounds=(1e-12, 1e9),
        source="inverse of the thermal resistance in the data sheet; a fit",
        meaning="Heat flow from winding to case per difference of temperature.",
    )
    case_heat_capacity_J_per_K: float = parameter(
        500.0,
        unit="J/K",
        bounds=(1e-12, 1e9),
        source="460-900 J/(kg K) times the motor's mass",
        meaning="Heat that warms the case by 1 K.",
    )
    case_to_ambient_W_per_K: float = parameter(
        0.5,
        unit="W/K",
        bounds=(1e-12, 1e9),
        source="inverse of the thermal resistance in the data sheet",
        meaning="Heat flow from the case to the air per difference of temperature.",
    )
    resistance_rise_per_K: float = parameter(
        COPPER_per_K,
        unit="1/K",
        bounds=(0.0, 0.01),
        source="copper, IEC 60028",
        meaning="Relative growth of the winding's resistance per kelvin.",
        free=False,
    )
    torque_constant_fall_per_K: float = parameter(
        0.0,
        unit="1/K",
        bounds=(0.0, 0.003),
        source="0: none; 0.0011 NdFeB, 0.002 ferrite",
        meaning="Relative fall of k_t and k_e per kelvin of the case, where the magnets are.",
    )
    torque_constant_fall_per_winding_K: float = parameter(
        0.0,
        unit="1/K",
        bounds=(0.0, 0.005),
        source="0: none; up to 0.0011 NdFeB, 0.002 ferrite where the magnets are as warm",
        meaning="The same per kelvin of the winding, for magnets that it warms.",
    )
    start_winding_rise_K: float = parameter(
        0.0,
        unit="K",
        bounds=(-60.0, 200.0),
        source="0: cold; an earlier recording warms it",
        meaning="Winding over ambient temperature at the start.",
    )
    start_case_rise_K: float = parameter(
        0.0,
        unit="K",
        bounds=(-60.0, 150.0),
        source="0: cold; measured at the case",
        meaning="Case over ambient temperature at the start.",
    )
    ambient_C: float = parameter(
        25.0,
        unit="C",
        bounds=(-40.0, 80.0),
        source="room",
        meaning="Air temperature, at which the rig's values hold.",
        free=False,
    )

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Largest growth of the resistance, by the hottest winding that the context names."""
        peak = context.need(self.effect, "peak_winding_rise_K")
        rise = self.resistance_rise_per_K * peak
        ambient = self.ambient_C if context.ambient_C is None else context.ambient_C
        return {"resistance_rise_fraction": rise, "peak_winding_C": ambient + peak}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The network, and what it acts on."""
        return {
            "winding_heat_capacity": self.winding_heat_capacity_J_per_K,
            "winding_to_case": self.winding_to_case_W_per_K,
            "case_heat_capacity": self.case_heat_capacity_J_per_K,
            "case_to_ambient": self.case_to_ambient_W_per_K,
            "resistance_rise": self.resistance_rise_per_K,
            "torque_constant_fall": self.torque_constant_fall_per_K,
            "torque_constant_fall_by_winding": self.torque_constant_fall_per_winding_K,
            "start_winding_rise": self.start_winding_rise_K,
            "start_case_rise": self.start_case_rise_K,
            "internal_states": 1.0,
        }

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """A current warms it."""
        electric = command_name in ("duty", "voltage_V", "current_command_A")
        return None if electric else "needs a drive by duty, voltage or current"

    def rig_numbers(self, rig, gravity: float) -> Mapping[str, float]:
        """The resistance that warms it."""
        rig.need("heat in the winding", "terminal_resistance_ohm")
        return {}

    def equation(self) -> str:
        G_wc = f"{self.winding_to_case_W_per_K:g} (h_w - h_c)"
        return (
            f"{self.winding_heat_capacity_J_per_K:g} h_w' = R i^2 - {G_wc},"
            f"  {self.case_heat_capacity_J_per_K:g} h_c' = {G_wc}"
            f" - {self.case_to_ambient_W_per_K:g} h_c,"
            f"  R = R_0 (1 + {self.resistance_rise_per_K:g} h_w),"
            f"  k_t, k_e (1 - {self.torque_constant_fall_per_K:g} h_c"
            f" - {self.torque_constant_fall_per_winding_K:g} h_w)"
        )

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """Winding and case, without and with magnets that the winding warms."""
        electric = bool(typical.commands & {"duty", "voltage_V"})
        if not electric and not (typical.relative and "current_command_A" in typical.commands):
            return ()
        unknowns, starts = _by_the_machine(typical) if typical.relative else _of_a_bench_motor()
        fall = Unknown(name="torque_constant_fall_per_winding_K", unit="1/K", low=0.0, high=0.005,
                       scale=3e-4, prior=WEAKER_per_K)  # fmt: skip
        weaker = 5e-4
        if not electric:  # a regulated current hides the resistance: heat and fall act as one
            fall, weaker = (
                replace(fall, low=MAGNETS_per_K, high=MAGNETS_per_K, scale=0.0),
                MAGNETS_per_K,
            )
        common = {"effect": cls.effect, "subsystem": "drive", "write": _write, "kind": cls,
                  "parameters": _parameters}  # fmt: skip
        with_magnets = Law(
            law="winding, case and magnets", unknowns=(*unknowns, fall),
            starts=tuple((*values, weaker) for values in starts), **common,
        )  # fmt: skip
        if not electric:
            return (replace(with_magnets, own_form_spread=MAGNETS_SPREAD),)
        return (
            Law(law="winding and case", unknowns=unknowns, starts=starts,
                richer=("winding, case and magnets",), **common),
            with_magnets,
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """How warm, and what it does."""
        return (
            f"a winding that warms to {f.figures['peak_winding_C']:.3g} °C,"
            f" its resistance up by {f.percent(f.figures['resistance_rise_fraction'])}"
        )
