"""Stability of a sampled loop, from the compiled controller itself.

The machine is linearised and discretised exactly for a held command; the controller is
differentiated numerically around its operating point, so what is analysed is the code that
runs, delay and filters included, and no second copy of its law. Quantisation and saturation
are left out: near zero a loop that is found stable may still chatter by an encoder count.
Margins are those of the loop broken at the command.

Source: Astrom & Wittenmark, Computer-Controlled Systems (1997), sections 3.2 and 3.4.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.linalg import expm

import rsea_core.engines.event_driven.states as k
from rsea_core.control.laws.base import CompiledController, Controller
from rsea_core.control.stability.crossings import crossings
from rsea_core.engines.linear.linearise import linearise
from rsea_core.errors import ControllerError
from rsea_core.machine.inputs import Load
from rsea_core.machine.spring_table import spring_torque_Nm
from rsea_core.model.actuator_model import ActuatorModel

STABLE_RADIUS = 1.0 + 1e-6  # a free joint's own drift is a pole at 1
CONSTANT = 1e-8  # a state whose row is this near to the identity's does not move
DRIFT_per_s = 0.1  # a slower mode is a free joint's drift, whose double pole is found to 1e-4
DIFFERENCE = 1e-6


@dataclass(frozen=True, kw_only=True)
class LoopMargins:
    """Stability of the sampled loop around one spring deflection.

    Attributes
    ----------
    pole_radius : float
        Largest magnitude of the closed loop's poles; stable below 1.
    gain_margin_dB : float
        Nearest change of the loop gain that brings it to -1, signed as by python-control: above 0
        a stable loop's gain may grow by so much; below 0 it must fall by so much for an unstable
        loop to become stable, or may fall by so much where the loop is stable; inf: none.
    gain_margin_Hz : float
        Frequency of that limit, NaN where there is none.
    gain_rise_dB, gain_fall_dB : float
        Nearest limits above and below 0 dB; inf, -inf where there is none.
    gain_fall_Hz : float
        Frequency of the one below, NaN where there is none.
    phase_margin_deg : float
        Signed, of the gain crossover that is nearest to -1: below 0 the loop is beyond -180
        degrees there by so much; inf without a gain crossover.
    crossover_Hz : float
        Frequency of that crossover, NaN where there is none.
    delay_margin_s : float
        Shortest additional delay that makes a stable loop unstable; inf without a gain crossover.
    modulus_margin : float
        Smallest distance of the open loop from -1; its inverse is the peak of the sensitivity.
    deflection_rad : float
    """

    pole_radius: float
    gain_margin_dB: float
    gain_margin_Hz: float
    gain_rise_dB: float
    gain_fall_dB: float
    gain_fall_Hz: float
    phase_margin_deg: float
    crossover_Hz: float
    delay_margin_s: float
    modulus_margin: float
    deflection_rad: float

    @property
    def is_stable(self) -> bool:
        """Whether disturbances die out."""
        return self.pole_radius < STABLE_RADIUS


def loop_margins(
    model: ActuatorModel,
    controller: Controller,
    load: Load,
    *,
    deflection_rad: float = 0.0,
    load_angle_rad: float = 0.0,
    in_contact: bool = False,
) -> LoopMargins:
    """Poles and margins of the loop around a deflection of the spring.

    Raises
    ------
    RseaError
        If the controller or the model cannot be used with this load.
    """
    loop = _linear_loop(model, controller, load, deflection_rad, load_angle_rad, in_contact)
    radius = loop.radius
    found = crossings(
        lambda f: loop.response(f, controller.sample_time_s),
        controller.sample_time_s,
        np.linalg.eigvals(loop.A),
    )
    (gain, at_gain), (phase, at_phase) = found.gain_margin, found.phase_margin
    fall, at_fall = found.gain_fall
    return LoopMargins(
        pole_radius=radius,
        gain_margin_dB=gain,
        gain_margin_Hz=at_gain,
        gain_rise_dB=found.gain_rise_dB,
        gain_fall_dB=fall,
        gain_fall_Hz=at_fall,
        phase_margin_deg=phase,
        crossover_Hz=at_phase,
        delay_margin_s=found.delay_margin_s,
        modulus_margin=found.modulus_margin,
        deflection_rad=deflection_rad,
    )


def pole_radius(model: ActuatorModel, controller: Controller, load: Load) -> float:
    """Largest magnitude of the closed loop's poles at zero deflection, without its margins.

    Raises
    ------
    RseaError
        If the controller or the model cannot be used with this load.
    """
    return _linear_loop(model, controller, load, 0.0, 0.0, False).radius


def slowest_swing_Hz(model: ActuatorModel, controller: Controller, load: Load) -> float:
    """Lowest frequency at which the machine or the loop around it swings, inf: neither does.

    A mode swings if its damping ratio is below 0.7. A loop without a gain at rest has no modes,
    and of it the machine's alone count.

    Raises
    ------
    RseaError
        If the controller or the model cannot be used with this load.
    """
    command_name = controller.compile(model, load).command_name
    rates = np.linalg.eigvals(linearise(model, command_name=command_name, load=load).A)
    if controller.has_gain_at_rest:
        poles = _linear_loop(model, controller, load, 0.0, 0.0, False).poles
        poles = poles[np.isfinite(poles) & (np.abs(poles) > CONSTANT)].astype(complex)
        rates = np.concatenate((rates, np.log(poles) / controller.sample_time_s))
    swings = rates[np.abs(rates.imag) > np.maximum(np.abs(rates.real), DRIFT_per_s)].imag
    return float(np.abs(swings).min(initial=np.inf)) / (2.0 * np.pi)


def open_loop_response(
    model: ActuatorModel, controller: Controller, load: Load, frequencies_Hz: NDArray
) -> NDArray:
    """The sampled loop broken at the command, complex (f,); it is unstable around -1.

    Raises
    ------
    RseaError
        If the controller or the model cannot be used with this load.
    """
    loop = _linear_loop(model, controller, load, 0.0, 0.0, False)
    return loop.response(np.asarray(frequencies_Hz, dtype=float), controller.sample_time_s)


def linear_tracking(
    model: ActuatorModel, controller: Controller, load: Load, frequency_Hz: float
) -> complex:
    """Torque over reference at a frequency, as the linear sampled loop has it at its samples.

    Raises
    ------
    RseaError
        If the controller or the model cannot be used with this load.
    """
    loop = _linear_loop(model, controller, load, 0.0, 0.0, False)
    s = 2j * np.pi * frequency_Hz
    z = np.exp(s * controller.sample_time_s)
    driven = loop.reference @ np.array([1.0, s, s**2])
    return complex(loop.torque @ np.linalg.solve(z * np.eye(loop.b.size) - loop.closed, driven))


def port_impedance(
    model: ActuatorModel, controller: Controller, frequencies_Hz: NDArray
) -> NDArray | None:
    """What a load feels of the loop, complex (f,) [Nms/rad]: -tau_s over the load's speed.

    The load swings as it is made to, the reference is zero, and torque is that of the samples.
    None for a loop that is unstable with its load held: it has no steady swing.

    Raises
    ------
    RseaError
        If the controller or the model cannot be used with a load whose motion is given.
    """
    load = Load(kind="imposed")
    if pole_radius(model, controller, load) >= 1.0:
        return None
    found = np.empty(len(frequencies_Hz), dtype=complex)
    for j, frequency in enumerate(frequencies_Hz):
        s = 2j * np.pi * frequency
        loop = _linear_loop(model, controller, load, 0.0, 0.0, False, load_rate_per_s=s)
        given = [k.TL, k.WL]  # the angle is 1; a law with ideal sensors reads its speed, too
        moves = np.setdiff1d(np.arange(loop.b.size), given)
        closed = loop.closed
        turn = np.exp(s * controller.sample_time_s) * np.eye(loop.b.size) - closed
        state = np.zeros(loop.b.size, dtype=complex)
        state[given] = 1.0, s
        driven = closed[np.ix_(moves, given)] @ state[given]
        state[moves] = np.linalg.solve(turn[np.ix_(moves, moves)], driven)
        found[j] = -(loop.torque @ state) / s
    return found


def require_stable(
    model: ActuatorModel, controller: Controller, load: Load, *, load_angle_rad: float = 0.0
) -> LoopMargins:
    """Margins at zero deflection, once the loop is found stable over the spring's range.

    Raises
    ------
    ControllerError
        If the loop is unstable at zero deflection, at either end of the spring's valid range,
        or in contact; the message gives pole radius and what the loop gain would have to be.
    """
    table = model.spring_table(load)
    ends = [d for d in (table.valid_low_rad, table.valid_high_rad) if np.isfinite(d)]
    contacts = (False, True) if load.kind == "contact" else (False,)
    found = [
        loop_margins(
            model,
            controller,
            load,
            deflection_rad=deflection,
            load_angle_rad=load_angle_rad,
            in_contact=contact,
        )
        for deflection in (0.0, *ends)
        for contact in contacts
    ]
    for margins in found:
        if not margins.is_stable:
            raise ControllerError(_unstable(margins, controller))
    return found[0]


def _unstable(found: LoopMargins, controller: Controller) -> str:
    text = (
        f"the loop is unstable at {found.deflection_rad:.3g} rad of spring deflection: pole"
        f" radius {found.pole_radius:.5g} at a sample time of {controller.sample_time_s:g} s,"
        " must be below 1"
    )
    if np.isfinite(found.gain_fall_dB):
        factor = 10.0 ** (found.gain_fall_dB / 20.0)
        text += (
            f"; its gain is {-found.gain_fall_dB:.2g} dB too high at"
            f" {found.gain_fall_Hz:.3g} Hz: all gains times less than {factor:.3g} would do"
        )
    return text


@dataclass(frozen=True, kw_only=True)
class _Loop:
    """States of machine, controller and delay; the command goes in by b and comes out by c."""

    A: NDArray
    b: NDArray
    c: NDArray
    reference: NDArray  # (states, 3) from the reference and its derivatives, loop closed
    torque: NDArray

    @property
    def closed(self) -> NDArray:
        return self.A + np.outer(self.b, self.c)

    @property
    def poles(self) -> NDArray:
        """Of the closed loop, in z; states that never move left out, inf where it has none."""
        closed = self.closed
        if not np.isfinite(closed).all():
            return np.array([np.inf])
        moving = ~np.all(np.abs(closed - np.eye(self.b.size)) < CONSTANT, axis=1)
        return np.linalg.eigvals(closed[np.ix_(moving, moving)])

    @property
    def radius(self) -> float:
        """Largest magnitude of the poles."""
        return float(np.abs(self.poles).max())

    def response(self, frequencies_Hz: NDArray, sample_time_s: float) -> NDArray:
        """The loop broken at the command, complex (f,)."""
        z = np.exp(2j * np.pi * frequencies_Hz * sample_time_s)
        resolvent = z[:, None, None] * np.eye(self.b.size) - self.A
        return -np.linalg.solve(resolvent, self.b[:, None])[..., 0] @ self.c


def _linear_loop(
    model, controller, load, deflection, load_angle, in_contact, *, load_rate_per_s=0.0
) -> _Loop:
    """The loop; an imposed load's angle follows exp(load_rate_per_s t)."""
    compiled = controller.compile(model, load)
    linear = linearise(
        model,
        command_name=compiled.command_name,
        load=load,
        deflection_rad=deflection,
        load_angle_rad=load_angle,
        in_contact=in_contact,
    )
    plant = model.plant(compiled.command_name, load)
    n = k.N_STATES
    held = np.block([[linear.A, linear.b[:, None]], [np.zeros((1, n + 1))]])
    if load_rate_per_s != 0.0:
        held = held.astype(complex)
        held[k.TL, k.TL] = load_rate_per_s
    step = expm(controller.sample_time_s * held)
    readings = _readings(plant.gear_ratio, linear.torque_row)
    state = np.zeros(n)
    state[[k.TW, k.TL]] = deflection + load_angle, load_angle
    point = readings @ state
    torque = float(spring_torque_Nm(model.spring_table(load), deflection))
    point[[k.REFERENCE, k.TRUE_TORQUE]] = torque
    Ac, Bc, Cc, Dc = _differentiate(compiled, point)

    m, delay = Cc.size, controller.delay_samples
    size = n + m + delay
    A, b = np.zeros((size, size), dtype=step.dtype), np.zeros(size, dtype=step.dtype)
    c, reference = np.zeros(size), np.zeros((size, 3), dtype=step.dtype)
    A[:n, :n], b[:n] = step[:n, :n], step[:n, n]
    A[n : n + m, :n], A[n : n + m, n : n + m] = Bc @ readings, Ac
    reference[n : n + m] = Bc[:, :3]
    answer = np.concatenate((Dc @ readings, Cc))
    if delay:
        A[-1, : n + m], reference[-1] = answer, Dc[:3]
        c[-1] = 1.0
    else:
        c[: n + m] = answer
        reference += np.outer(b, Dc[:3])
    shown = np.zeros(size)
    shown[:n] = linear.torque_row
    return _Loop(A=A, b=b, c=c, reference=reference, torque=shown)


def _readings(gear_ratio: float, torque_row: NDArray) -> NDArray:
    """(N_SIGNALS, N_STATES) matrix: what each signal shows of each state."""
    C = np.zeros((k.N_SIGNALS, k.N_STATES))
    C[[k.READ_MOTOR_ANGLE, k.TRUE_MOTOR_ANGLE], k.TW] = gear_ratio
    C[[k.READ_LOAD_ANGLE, k.TRUE_LOAD_ANGLE], k.TL] = 1.0
    C[k.READ_CURRENT, k.IM] = 1.0
    C[k.TRUE_TORQUE] = torque_row
    C[k.TRUE_MOTOR_VELOCITY, k.WW] = gear_ratio
    C[k.TRUE_LOAD_VELOCITY, k.WL] = 1.0
    return C


@njit(cache=True)
def _act(function, parameters, state, signals, command):
    function(parameters, state, signals, command)


def _differentiate(compiled: CompiledController, point: NDArray):
    """State-space matrices A, B, C, D of the controller around an operating point."""

    def act(both: NDArray) -> NDArray:
        after, command = both[:n].copy(), np.zeros(k.N_COMMANDS)
        _act(compiled.function, compiled.parameters, after, both[n:].copy(), command)
        return np.append(after, command[k.UNSATURATED])

    n = compiled.state.size
    start = np.concatenate((compiled.state, point))
    start[:n] = act(start)[:n]  # once, so that it has acted before
    jacobian = np.zeros((n + 1, start.size))
    for j in range(start.size):
        shift = np.zeros(start.size)
        shift[j] = DIFFERENCE
        jacobian[:, j] = (act(start + shift) - act(start - shift)) / (2.0 * DIFFERENCE)
    return jacobian[:n, :n], jacobian[:n, n:], jacobian[n, :n], jacobian[n, n:]
