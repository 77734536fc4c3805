"""Large-torque bandwidth: how fast a large torque can be made, and what stands in the way.

For a sine of the torque on a locked output, from the machine linearised at rest: every limit as
the largest amplitude that it allows at a frequency. A gear without losses is assumed; a worm's
friction takes its share of the current's and the heat's.

Source: Robinson's large force bandwidth as the thesis cites it [54]; the maximum torque
transmissibility of Lee, Kwak, Kwak & Oh separates the same limits of current and speed.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

import rsea_core.engines.event_driven.states as k
from rsea_core.engines.linear.linearise import linearise
from rsea_core.errors import InputError, RigError
from rsea_core.machine.inputs import Load
from rsea_core.machine.spring_table import spring_torque_Nm
from rsea_core.model.actuator_model import ActuatorModel

LOCKED = Load(kind="locked")
SQUARE_WAVE = 4.0 / math.pi  # fundamental of a square wave of amplitude 1
LOWEST_Hz, HIGHEST_Hz, GRID = 1e-3, 1e3, 600


@dataclass(frozen=True, kw_only=True)
class AmplitudeLimits:
    """Largest sine amplitude of the torque at one frequency, by each limit; inf: no limit.

    Attributes
    ----------
    frequency_Hz : float
    supply_Nm : float
        Full supply voltage at the winding.
    speed_Nm : float
        The no-load speed, whatever the torque: K w_no_load / (2 pi f).
    current_Nm : float
        The drive's current limit.
    contact_Nm : float
        The end of the spring's valid range, where coils touch.
    heat_Nm : float
        The continuous current, root mean square.
    back_emf_share : float
        Of the voltage needed: |k_e N w| over |u|.
    """

    frequency_Hz: float
    supply_Nm: float
    speed_Nm: float
    current_Nm: float
    contact_Nm: float
    heat_Nm: float
    back_emf_share: float

    @property
    def largest_Nm(self) -> float:
        """What all limits together allow."""
        return min(self.supply_Nm, self.current_Nm, self.contact_Nm, self.heat_Nm)

    @property
    def binding(self) -> str:
        """ "speed", "voltage", "current", "contact", "heat" or "none".

        The supply's limit is called "speed" where back-EMF takes the larger part of the voltage,
        "voltage" where resistance and inductance do.
        """
        supply = "speed" if self.back_emf_share > math.sqrt(0.5) else "voltage"
        known = {
            supply: self.supply_Nm,
            "current": self.current_Nm,
            "contact": self.contact_Nm,
            "heat": self.heat_Nm,
        }
        found = min(known, key=known.get)
        return found if math.isfinite(known[found]) else "none"


@dataclass(frozen=True, kw_only=True)
class TorqueBandwidth:
    """Highest frequency at which a torque amplitude is still within every limit.

    Attributes
    ----------
    amplitude_Nm : float
    frequency_Hz : float
        0 where not even a torque at rest is possible, inf where nothing limits it up to 1 kHz.
    binding : str
        As `AmplitudeLimits.binding`, of the limit that is met there.
    square_wave_Hz : float
        The same with voltage or current switched fully to and fro, whose fundamental is 4/pi of
        a sine: no drive can do better, and none does it undistorted.
    """

    amplitude_Nm: float
    frequency_Hz: float
    binding: str
    square_wave_Hz: float


def amplitude_limits(
    model: ActuatorModel, frequency_Hz: float, *, continuous_current_A: float | None = None
) -> AmplitudeLimits:
    """What the drive and the spring allow at one frequency, output locked.

    Parameters
    ----------
    continuous_current_A : float or None
        DC-equivalent current that the winding stands for ever; None leaves heat out.

    Raises
    ------
    InputError
        If the frequency or the current is not above 0.
    RigError
        If the rig has no gear or spring, or lacks a value of its electric drive.
    """
    if not 0.0 < frequency_Hz < math.inf:
        raise InputError(f"frequency_Hz = {frequency_Hz} must be above 0")
    if continuous_current_A is not None and not continuous_current_A > 0.0:
        raise InputError(f"continuous_current_A = {continuous_current_A} must be above 0")
    if not (model.rig.has("gear") and model.rig.has("spring")):
        raise RigError(f"rig {model.rig.name!r}: torque limits need a gear and a spring")
    linear = linearise(model, command_name="duty", load=LOCKED)
    plant, spring = model.plant("duty", LOCKED), model.spring_table(LOCKED)
    s = 2j * np.pi * frequency_Hz
    states = np.linalg.solve(s * np.eye(k.N_STATES) - linear.A, linear.b)
    torque = abs(linear.torque_row @ states)
    emf = plant.volts_per_speed * states[k.WW]
    current = abs(states[k.IM])
    if not plant.inductance > 0.0:
        current = abs(plant.volts_per_command - emf) / plant.resistance
    no_load = np.inf
    if plant.volts_per_speed > 0.0:
        no_load = plant.volts_per_command / plant.volts_per_speed
    ends = (spring.valid_low_rad, spring.valid_high_rad)
    known = [abs(float(spring_torque_Nm(spring, d))) for d in ends if np.isfinite(d)]
    heat = np.inf
    if continuous_current_A is not None:
        heat = math.sqrt(2.0) * continuous_current_A * torque / current
    return AmplitudeLimits(
        frequency_Hz=float(frequency_Hz),
        supply_Nm=float(torque),
        speed_Nm=float(linear.torque_row[k.TW] * no_load / abs(s)),
        current_Nm=float(plant.current_limit * torque / current),
        contact_Nm=min(known, default=np.inf),
        heat_Nm=float(heat),
        back_emf_share=float(abs(emf) / plant.volts_per_command),
    )


def torque_bandwidth(
    model: ActuatorModel, amplitude_Nm: float, *, continuous_current_A: float | None = None
) -> TorqueBandwidth:
    """Highest frequency up to which a sine of this amplitude meets no limit.

    Raises
    ------
    InputError
        If the amplitude is not above 0.
    RigError
        As `amplitude_limits`.
    """
    if not 0.0 < amplitude_Nm < math.inf:
        raise InputError(f"amplitude_Nm = {amplitude_Nm} must be above 0")

    def at(log_f: float) -> AmplitudeLimits:
        return amplitude_limits(model, math.exp(log_f), continuous_current_A=continuous_current_A)

    def spare(log_f: float, drive_factor: float) -> float:
        found = at(log_f)
        driven = min(found.supply_Nm, found.current_Nm) * drive_factor
        return math.log(min(driven, found.contact_Nm, found.heat_Nm) / amplitude_Nm)

    sine, binding = _first_crossing(spare, 1.0), "none"
    if math.isfinite(sine):
        binding = at(math.log(max(sine, LOWEST_Hz))).binding
    return TorqueBandwidth(
        amplitude_Nm=float(amplitude_Nm),
        frequency_Hz=sine,
        binding=binding,
        square_wave_Hz=_first_crossing(spare, SQUARE_WAVE),
    )


def published_bandwidth_Hz(amplitude_Nm: float) -> float:
    """The curve through the thesis' measured points, f = 18.7149 T^-1.093.

    Two points of the text, 20.8 Nm at 0.1 Hz and 7 Nm at 15 Hz, are not on it.

    Source
    ------
    Caption of Figure 2.18, which calls the power law a cubic spline (errata S29).
    """
    return 18.7149 * amplitude_Nm**-1.093


def _first_crossing(spare, factor: float) -> float:
    """Lowest frequency where nothing is left to spare; between grid points by Brent's method."""
    grid = np.linspace(math.log(LOWEST_Hz), math.log(HIGHEST_Hz), GRID)
    last = None
    for x in grid:
        if spare(x, factor) < 0.0:
            return 0.0 if last is None else math.exp(brentq(spare, last, x, args=(factor,)))
        last = x
    return math.inf
