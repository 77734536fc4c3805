"""Margins of a nonlinear controller at a stated amplitude, by its describing function.

The compiled controller is fed the sines of wheel and load with which the linear machine swings at
a given amplitude, at its own sample time, and the first harmonic of its commands is compared
with the command behind that swing: filters, delays, fuzzy tables, powers and saturation are all
in it. The margins of this loop hold at this amplitude and at no other; where the margin vanishes
at some amplitude, a limit cycle of about that size is to be expected.

Source: Gelb & Vander Velde, Multiple-Input Describing Functions (1968), chapters 2 and 3.
"""

import functools
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

import rsea_core.engines.event_driven.states as k
from rsea_core.control.laws.base import Controller
from rsea_core.engines.linear.linearise import linearise
from rsea_core.errors import InputError
from rsea_core.machine.inputs import Load
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.numeric.source_version import SOURCE_VERSION

PERIODS = 6  # the last two are judged
FREQUENCIES = 160


@dataclass(frozen=True, kw_only=True)
class AmplitudeMargins:
    """Margins of a loop at one amplitude of what its controller reads.

    Attributes
    ----------
    amplitude : float
        Of the torque [Nm], or of the load's angle [rad] for a controller of the angle.
    gain_margin_dB, phase_margin_deg : float
        inf where there is no crossing.
    gain_margin_Hz, crossover_Hz : float
        NaN where there is no crossing.
    modulus_margin : float
        Smallest distance of the loop from -1.
    """

    amplitude: float
    gain_margin_dB: float
    gain_margin_Hz: float
    phase_margin_deg: float
    crossover_Hz: float
    modulus_margin: float


@functools.cache
def _feeder(version: int):
    @njit(error_model="numpy")
    def feed(controller, parameters, state, motor, load, commands):
        if version < 0:
            return
        signals, answer = np.zeros(k.N_SIGNALS), np.zeros(k.N_COMMANDS)
        for row in range(motor.size):
            signals[k.READ_MOTOR_ANGLE] = signals[k.TRUE_MOTOR_ANGLE] = motor[row]
            signals[k.READ_LOAD_ANGLE] = signals[k.TRUE_LOAD_ANGLE] = load[row]
            controller(parameters, state, signals, answer)
            commands[row] = answer[k.COMMAND]

    return feed


def harmonic_loop(
    controller: Controller,
    model: ActuatorModel,
    load: Load,
    *,
    amplitude: float,
    frequencies_Hz: NDArray,
) -> NDArray:
    """The loop broken at the command, complex (f,), for swings of this amplitude.

    At each frequency the machine swings so that the torque (for a torque controller) or the
    load's angle has the amplitude, wheel and load as its equations couple them; what the
    controller answers is compared with the command that this swing takes.

    Raises
    ------
    InputError
        If the amplitude is not positive.
    RseaError
        If controller and machine do not go together.
    """
    if not 0.0 < amplitude < np.inf:
        raise InputError(f"amplitude = {amplitude} must be finite and above 0")
    compiled = controller.compile(model, load)
    gear = model.plant(compiled.command_name, load).gear_ratio
    linear = linearise(model, command_name=compiled.command_name, load=load)
    torque_loop = controller.reference_name == "reference_torque_Nm"
    watched = linear.torque_row if torque_loop else np.eye(k.N_STATES)[k.TL]
    T, late = controller.sample_time_s, controller.delay_samples
    found = np.empty(len(frequencies_Hz), dtype=complex)
    for j, frequency in enumerate(frequencies_Hz):
        s = 2j * np.pi * frequency
        per_command = np.linalg.solve(s * np.eye(k.N_STATES) - linear.A, linear.b)
        needed = amplitude / abs(watched @ per_command)
        swing = needed * per_command
        count = max(int(np.ceil(PERIODS / (frequency * T))), 8)
        t = np.arange(count) * T
        turn = np.exp(s * t)
        motor, held = (swing[k.TW] * turn).real * gear, (swing[k.TL] * turn).real
        commands = np.empty(count)
        _feeder(SOURCE_VERSION)(
            compiled.function, compiled.parameters, compiled.state.copy(), motor, held, commands
        )
        rows = t >= t[-1] - 2.0 / frequency
        basis = np.column_stack((turn[rows].real, turn[rows].imag, np.ones(rows.sum())))
        cosine, sine = np.linalg.lstsq(basis, commands[rows], rcond=None)[0][:2]
        hold = (1.0 - np.exp(-s * T)) / (s * T)
        found[j] = -(cosine - 1j * sine) / needed * hold * np.exp(-s * T * late)
    return found


def amplitude_margins(
    controller: Controller,
    model: ActuatorModel,
    load: Load,
    *,
    amplitude: float,
    lowest_Hz: float = 0.05,
) -> AmplitudeMargins:
    """Gain and phase margin at an amplitude of torque [Nm] or load angle [rad].

    Raises
    ------
    RseaError
        As `harmonic_loop`.
    """
    f = np.geomspace(lowest_Hz, 0.45 / controller.sample_time_s, FREQUENCIES)
    loop = harmonic_loop(controller, model, load, amplitude=amplitude, frequencies_Hz=f)
    gain, at_gain = _gain_margin(f, loop)
    phase, at_phase = _phase_margin(f, loop)
    return AmplitudeMargins(
        amplitude=amplitude,
        gain_margin_dB=gain,
        gain_margin_Hz=at_gain,
        phase_margin_deg=phase,
        crossover_Hz=at_phase,
        modulus_margin=float(np.abs(1.0 + loop).min()),
    )


def predicted_limit_cycle(
    controller: Controller,
    model: ActuatorModel,
    load: Load,
    *,
    smallest: float,
    largest: float,
) -> tuple[float, float] | None:
    """Amplitude and frequency [Hz] at which the loop keeps swinging, None where there is none.

    Looked for is the largest amplitude between both bounds at which the phase margin turns from
    negative (a swing that grows) to positive (one that dies out); bisection to 1 %.

    Raises
    ------
    InputError
        If the bounds are not 0 < smallest < largest.
    RseaError
        As `harmonic_loop`.
    """
    if not 0.0 < smallest < largest:
        raise InputError(f"amplitudes must be 0 < smallest < largest, not {smallest}, {largest}")

    def margins(amplitude: float) -> AmplitudeMargins:
        return amplitude_margins(controller, model, load, amplitude=amplitude, lowest_Hz=0.5)

    sizes = np.geomspace(smallest, largest, 13)
    signs = [margins(a).phase_margin_deg > 0.0 for a in sizes]
    turns = [j for j in range(len(sizes) - 1) if not signs[j] and signs[j + 1]]
    if not turns:
        return None
    low, high = sizes[turns[-1]], sizes[turns[-1] + 1]
    while high > 1.01 * low:
        middle = np.sqrt(low * high)
        if margins(middle).phase_margin_deg > 0.0:
            high = middle
        else:
            low = middle
    return float(high), margins(float(high)).crossover_Hz


def _gain_margin(f: NDArray, loop: NDArray) -> tuple[float, float]:
    """The smallest of all crossings of the negative axis."""
    below = (np.diff(np.sign(loop.imag)) != 0) & (loop.real[:-1] < 0.0)
    best, where = np.inf, np.nan
    for j in np.flatnonzero(below):
        share = loop.imag[j] / (loop.imag[j] - loop.imag[j + 1])
        size = abs(loop.real[j] + share * (loop.real[j + 1] - loop.real[j]))
        margin = -20.0 * np.log10(size) if size > 0.0 else np.inf
        if abs(margin) < abs(best):
            best, where = float(margin), float(f[j] * (f[j + 1] / f[j]) ** share)
    return best, where


def _phase_margin(f: NDArray, loop: NDArray) -> tuple[float, float]:
    """The smallest over all crossings of magnitude one."""
    size = np.log(np.abs(loop))
    best, where = np.inf, np.nan
    for j in np.flatnonzero(np.diff(np.sign(size)) != 0):
        share = size[j] / (size[j] - size[j + 1])
        angle = np.angle(loop[j]) + share * np.angle(loop[j + 1] / loop[j])
        margin = float(np.degrees(np.angle(-np.exp(1j * angle))))
        if abs(margin) < abs(best):
            best, where = margin, float(f[j] * (f[j + 1] / f[j]) ** share)
    return best, where
