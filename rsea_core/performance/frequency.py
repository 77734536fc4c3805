"""The linear machine over frequency: natural frequencies, Bode data, output impedance.

All on the output side. Frequencies in Hz, poles in rad/s.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

import rsea_core.engines.event_driven.states as k
from rsea_core.engines.linear.linearise import STATE_NAMES, LinearModel, linearise
from rsea_core.errors import InputError, RigError
from rsea_core.machine.inputs import Load
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.numeric.arrays import read_only
from rsea_core.numeric.brief_repr import BriefRepr

TORQUE = "torque_Nm"
OUTPUTS = (TORQUE, *STATE_NAMES)


@dataclass(frozen=True, kw_only=True)
class NaturalFrequencies:
    """Undamped frequencies of the joint without its drive's back-EMF.

    Attributes
    ----------
    locked_Hz : float
        sqrt(K / J) / 2 pi: motor and wheel against the spring, output locked.
    free_Hz : float or None
        sqrt(K / J + K / J_l) / 2 pi: motor against the free load; None without a load inertia.
    motor_held_Hz : float or None
        sqrt(K / J_l) / 2 pi: the load alone, behind a self-locking gear.
    stiffness_Nm_per_rad : float
        The spring's tangent at the deflection asked for.
    inertia_kgm2, load_inertia_kgm2 : float
        J (N^2 J_m + J_o) and J_l.
    """

    locked_Hz: float
    free_Hz: float | None
    motor_held_Hz: float | None
    stiffness_Nm_per_rad: float
    inertia_kgm2: float
    load_inertia_kgm2: float


def natural_frequencies(model: ActuatorModel, *, deflection_rad: float = 0.0) -> NaturalFrequencies:
    """Natural frequencies with locked and with free output, by the eigenvalues of the machine.

    Raises
    ------
    RigError
        If the machine has no gear or no spring, or lacks an inertia.

    Source
    ------
    The thesis' 2.32 takes sqrt(K / J_x) with the motor-side inertia and so finds 72 Hz (313 Hz
    with the rotor alone); the inertia at the output belongs there (errata D9).
    """
    rig = model.rig
    if not (rig.has("gear") and rig.has("spring")):
        raise RigError(f"rig {rig.name!r}: natural frequencies need a gear and a spring")
    command = "motor_torque_Nm" if rig.has("drive") else None
    locked = linearise(
        model, command_name=command, load=Load(kind="locked"), deflection_rad=deflection_rad
    )
    plant = model.plant(command, Load(kind="locked"))
    stiffness = float(locked.torque_row[k.TW])
    load_inertia = (rig.load_inertia_kgm2 or 0.0) if rig.has("load") else 0.0
    masses = {"locked_Hz": [plant.inertia, np.inf], "free_Hz": None, "motor_held_Hz": None}
    if load_inertia > 0.0:
        masses["free_Hz"] = [plant.inertia, load_inertia]
        masses["motor_held_Hz"] = [np.inf, load_inertia]
    found = {
        name: None if pair is None else _fastest_Hz(stiffness, np.array(pair))
        for name, pair in masses.items()
    }
    return NaturalFrequencies(
        **found,
        stiffness_Nm_per_rad=stiffness,
        inertia_kgm2=plant.inertia,
        load_inertia_kgm2=load_inertia,
    )


def _fastest_Hz(stiffness: float, inertia: NDArray) -> float:
    """Highest undamped frequency of two inertias joined by a spring."""
    joint = stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]]) / inertia[:, None]
    return float(np.sqrt(np.linalg.eigvals(joint).real.max()) / (2.0 * np.pi))


@dataclass(frozen=True, kw_only=True, repr=False)
class BodeData(BriefRepr):
    """A frequency response as it is plotted; arrays (n,), read-only.

    Attributes
    ----------
    frequency_Hz : array
    response : array
        Complex, in `output` units per command unit.
    output : str
    command_name : str
    """

    frequency_Hz: NDArray
    response: NDArray
    output: str
    command_name: str

    @property
    def magnitude_dB(self) -> NDArray:
        """20 log10 of the response's magnitude, (n,)."""
        return 20.0 * np.log10(np.abs(self.response))

    @property
    def phase_deg(self) -> NDArray:
        """Phase without jumps of 360 degrees, (n,)."""
        return np.rad2deg(np.unwrap(np.angle(self.response)))

    def bandwidth_Hz(self) -> float | None:
        """Where the magnitude first falls 3 dB below the lowest frequency's; None if it doesn't.

        Interpolated in the logarithms of both.
        """
        level = self.magnitude_dB - self.magnitude_dB[0] + 10.0 * np.log10(2.0)
        below = np.flatnonzero(level < 0.0)
        if below.size == 0:
            return None
        i = below[0]
        share = level[i - 1] / (level[i - 1] - level[i])
        log_f = np.log(self.frequency_Hz)
        return float(np.exp(log_f[i - 1] + share * (log_f[i] - log_f[i - 1])))


def bode(
    model: ActuatorModel,
    frequency_Hz: ArrayLike,
    *,
    command_name: str = "duty",
    load: Load,
    output: str = TORQUE,
    deflection_rad: float = 0.0,
) -> BodeData:
    """Response of the open machine to its command, around a deflection.

    Raises
    ------
    InputError
        If a frequency is not above 0 or the output is unknown.
    RigError
        If the rig lacks a value that drive and load need.
    """
    f = _checked_frequencies(frequency_Hz)
    linear = linearise(model, command_name=command_name, load=load, deflection_rad=deflection_rad)
    row = output_row(linear, output)
    states = np.linalg.solve(_resolvent(linear.A, f), linear.b[:, None])[..., 0]
    return BodeData(
        frequency_Hz=f,
        response=read_only(states @ row),
        output=output,
        command_name=command_name,
    )


def output_row(linear: LinearModel, output: str) -> NDArray:
    """Row c of y = c x for the torque or one of the states.

    Raises
    ------
    InputError
        If the output is not one of OUTPUTS.
    """
    if output not in OUTPUTS:
        raise InputError(f"output {output!r} must be one of {', '.join(OUTPUTS)}")
    if output == TORQUE:
        return linear.torque_row
    return read_only(np.eye(k.N_STATES)[STATE_NAMES.index(output)])


def output_impedance(
    model: ActuatorModel,
    frequency_Hz: ArrayLike,
    *,
    command_name: str | None = "motor_torque_Nm",
    deflection_rad: float = 0.0,
) -> NDArray:
    """Torque that turns the output over its angle, -tau_s / theta_l, (n,) complex [Nm/rad].

    The command is zero meanwhile: "motor_torque_Nm" is the motor left free, "duty" its winding
    short-circuited by the bridge, which brakes by back-EMF. The load's own inertia is not in it.

    Raises
    ------
    InputError
        If a frequency is not above 0.
    RigError
        If the rig has no spring or lacks a value that the drive needs.

    Source
    ------
    Z = K (J s^2 + B s) / (J s^2 + B s + K) with a free motor: the thesis' 2.33 with its sign
    set right (errata D10).
    """
    f = _checked_frequencies(frequency_Hz)
    if not (model.rig.has("spring") and model.rig.has("gear")):
        raise RigError(f"rig {model.rig.name!r}: an output impedance needs a gear and a spring")
    linear = linearise(
        model,
        command_name=command_name,
        load=Load(kind="locked"),
        deflection_rad=deflection_rad,
    )
    own = [k.IM, k.TW, k.WW]
    moved = linear.A[own, k.TL]
    states = np.linalg.solve(_resolvent(linear.A[np.ix_(own, own)], f), moved[:, None])[..., 0]
    return read_only(-(states @ linear.torque_row[own] + linear.torque_row[k.TL]))


def _resolvent(A: NDArray, f: NDArray) -> NDArray:
    return (2j * np.pi * f)[:, None, None] * np.eye(A.shape[0]) - A


def _checked_frequencies(frequency_Hz: ArrayLike) -> NDArray:
    f = np.atleast_1d(np.array(frequency_Hz, dtype=float))
    if f.ndim != 1 or not np.all(np.isfinite(f)) or not np.all(f > 0.0):
        raise InputError("frequency_Hz must be numbers above 0")
    return read_only(f)
