"""LQG torque control with integral action: state feedback on a steady Kalman predictor.

The machine is linearised at rest, discretised exactly for a held command and, where a command
acts a sample late, extended by it. The regulator minimises

    sum  q_tau e^2 + q_i (int e dt)^2 + r u^2

around the motion that the reference asks for (`torque_loop`), so that feedforward and friction
compensation are those of the other loops. The predictor takes the encoders' counts as white
noise of count^2 / 12 and an unknown torque on wheel and load as the disturbance.

Source: Astrom & Wittenmark, Computer-Controlled Systems (1997), chapters 9 and 11; Riccati
equations by scipy.linalg.solve_discrete_are.
"""

import functools
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numba import cfunc, njit
from numpy.typing import NDArray
from scipy.linalg import expm, solve_discrete_are

import rsea_core.control.laws.torque_loop as loop
import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp
from rsea_core.control.laws.base import require_values
from rsea_core.engines.linear.linearise import linearise
from rsea_core.errors import ControllerError
from rsea_core.numeric.source_version import SOURCE_VERSION

FINEST_COUNT_rad = 1e-6  # of a sensor without counts
# own parameters: sizes, then scalars, then matrices by rows
N, LATE, PER_AMPERE = range(loop.N_SHARED, loop.N_SHARED + 3)
MATRICES = loop.N_SHARED + 3
LARGEST = 5
ESTIMATE = loop.N_SHARED_STATE
GIVEN = ESTIMATE + LARGEST
SUM = GIVEN + 1
N_STATE = SUM + 1
AT_B = MATRICES + LARGEST * LARGEST
AT_L = AT_B + LARGEST
AT_K = AT_L + 2 * LARGEST
ELECTRIC_AT = AT_K + LARGEST + 2
SPRING = ELECTRIC_AT + 1


@dataclass(frozen=True, kw_only=True)
class LqgTorque(loop.TorqueLoop):
    """Linear-quadratic torque control with integral action and a Kalman predictor.

    Attributes
    ----------
    torque_weight : float
        q_tau [1/Nm^2].
    integral_weight : float
        q_i [1/(Nm s)^2].
    command_weight : float
        r [1 / full command^2].
    disturbance_Nm : float
        Standard deviation of the unknown torque, held over a sample: large follows the
        encoders, small trusts the model.

    The others, and what is raised, are those of `torque_loop.TorqueLoop`.
    """

    kind: ClassVar[str] = "lqg-torque"
    gains: ClassVar[tuple[str, ...]] = ("integral_weight",)
    n_states: ClassVar[int] = N_STATE

    torque_weight: float = 1.0
    integral_weight: float = 400.0
    command_weight: float = 0.3
    disturbance_Nm: float = 20.0

    def __post_init__(self):
        super().__post_init__()
        positive = ("torque_weight", "command_weight", "disturbance_Nm")
        require_values(self, positive, "finite and above 0")

    def own(self, machine: loop.LoopMachine):
        """Solve both Riccati equations for the machine and pack what comes out.

        Raises
        ------
        ControllerError
            If the machine cannot be regulated.
        """
        model, load, plant, limit, _ = machine
        linear = linearise(model, command_name=self.command_name, load=load)
        electric = self.command_name in loop.ELECTRIC and plant.inductance > 0.0
        states = [k.IM] * electric + [k.TW, k.WW]
        if plant.structure == mp.ELASTIC_FREE:
            states += [k.TL, k.WL]
        A = linear.A[np.ix_(states, states)]
        step = expm(
            self.sample_time_s
            * np.block([[A, linear.b[states][:, None]], [np.zeros((1, len(states) + 1))]])
        )
        n = len(states)
        Ad, bd = step[:n, :n], step[:n, n]
        torque_row = linear.torque_row[states]
        L = _kalman(Ad, states, plant, self)
        seen = _regulated(A, states)
        gain = regulator_gain(
            seen @ Ad @ np.linalg.pinv(seen),
            seen @ bd,
            torque_row @ np.linalg.pinv(seen),
            limit,
            self,
        )
        on_states = gain[: len(seen)] @ seen
        head = [n, self.delay_samples, 1.0 / plant.torque_per_ampere if electric else 0.0]
        blocks = (
            _padded(Ad, LARGEST), _padded(bd, 1), _padded(L, 2), _padded(on_states, 1),
            gain[len(seen) :], [float(electric)],
        )  # fmt: skip
        own = np.concatenate([head, *(np.ravel(block) for block in blocks)])
        return _compiled(SOURCE_VERSION), own


def _padded(matrix: NDArray, columns: int) -> NDArray:
    """(LARGEST, columns): filled up with zeros below and to the right."""
    found = np.zeros((LARGEST, columns))
    held = matrix.reshape(len(matrix), -1)
    found[: held.shape[0], : held.shape[1]] = held
    return found


def _regulated(A: NDArray, states: list[int]) -> NDArray:
    """(regulated, n) matrix: what of the states the regulator returns to rest.

    All of them, but for a load that nothing pulls back: the angle that wheel and load have in
    common is then a pole at 1 that the torque never shows, so that no feedback on it is optimal.
    """
    every = np.eye(len(states))
    if k.TL not in states:
        return every
    wheel, load = states.index(k.TW), states.index(k.TL)
    if np.abs(A @ (every[wheel] + every[load])).max() > 1e-12 * np.abs(A).max():
        return every
    every[wheel, load] = -1.0  # the deflection takes the wheel's place
    return np.delete(every, load, axis=0)


def _kalman(Ad: NDArray, states: list[int], plant: mp.Plant, law: LqgTorque) -> NDArray:
    """Steady gain of the filter, (n, 2): corrections by wheel and load angle."""
    n, T = len(states), law.sample_time_s
    angles = [i for i, state in enumerate(states) if state in (k.TW, k.TL)]
    C = np.zeros((len(angles), n))
    C[np.arange(len(angles)), angles] = 1.0
    counts = {k.TW: plant.motor_count / plant.gear_ratio, k.TL: plant.load_count}
    noise = [max(counts[states[i]], FINEST_COUNT_rad) ** 2 / 12.0 for i in angles]
    disturbances = []
    for state, inertia in ((k.WW, plant.inertia), (k.WL, plant.load_inertia)):
        if state in states:
            disturbance = np.zeros(n)
            disturbance[states.index(state)] = law.disturbance_Nm * T / inertia
            disturbance[states.index(state) - 1] = 0.5 * law.disturbance_Nm * T**2 / inertia
            disturbances.append(disturbance)
    Q = sum(np.outer(disturbance, disturbance) for disturbance in disturbances) + 1e-14 * np.eye(n)
    P = solve_discrete_are(Ad.T, C.T, Q, np.diag(noise))
    gain = P @ C.T @ np.linalg.inv(C @ P @ C.T + np.diag(noise))
    found = np.zeros((n, 2))
    found[:, : len(angles)] = gain
    return found


def regulator_gain(
    Ad: NDArray, bd: NDArray, torque_row: NDArray, limit: float, law: LqgTorque
) -> NDArray:
    """Gain on the states, the command under way and the integral of the torque error.

    Raises
    ------
    ControllerError
        If the Riccati equation has no stabilising solution.
    """
    n, T, late = len(bd), law.sample_time_s, law.delay_samples
    size = n + late + 1
    A, b = np.zeros((size, size)), np.zeros(size)
    A[:n, :n] = Ad
    if late:
        A[:n, n], b[n] = bd, 1.0
    else:
        b[:n] = bd
    A[-1, :n], A[-1, -1] = -T * torque_row, 1.0
    Q = np.zeros((size, size))
    Q[:n, :n] = law.torque_weight * np.outer(torque_row, torque_row)
    Q[-1, -1] = law.integral_weight
    R = np.array([[law.command_weight / limit**2]])
    try:
        P = solve_discrete_are(A, b[:, None], Q + 1e-12 * np.eye(size), R)
    except np.linalg.LinAlgError as problem:
        raise ControllerError(
            f"{law.kind}: this machine has no stabilising feedback at a sample time of"
            f" {T:g} s ({problem})"
        ) from problem
    gain = (b @ P @ A) / (R[0, 0] + b @ P @ b)
    found = np.zeros(n + 2)
    found[:n], found[-1] = gain[:n], gain[-1]
    if late:
        found[n] = gain[n]
    return found


@njit(error_model="numpy", inline="always")
def _correct(p, s, wheel, load, free):
    """The estimate by what is read of wheel and load."""
    at = ESTIMATE + int(p[ELECTRIC_AT])
    off_wheel = wheel - s[at]
    off_load = load - s[at + 2] if free else 0.0
    for i in range(int(p[N])):
        s[ESTIMATE + i] += p[AT_L + 2 * i] * off_wheel + p[AT_L + 2 * i + 1] * off_load


@njit(error_model="numpy", inline="always")
def _predict(p, s, given):
    """The estimate a sample later; `given`: the command, which may act a sample late."""
    n = int(p[N])
    acting = s[GIVEN] if p[LATE] != 0.0 else given
    s[GIVEN] = given if p[LATE] != 0.0 else 0.0
    ahead = np.zeros(LARGEST)
    for i in range(n):
        ahead[i] = p[AT_B + i] * acting
        for j in range(n):
            ahead[i] += p[MATRICES + i * LARGEST + j] * s[ESTIMATE + j]
    for i in range(n):
        s[ESTIMATE + i] = ahead[i]


@functools.cache
def _compiled(version: int):
    """The law as compiled code, made when first used."""
    m = LARGEST

    def lqg(p, s, y, command):
        if version < 0:
            return
        spring = p[SPRING:].reshape(-1, 6)
        n, electric = int(p[N]), int(p[ELECTRIC_AT])
        first = s[loop.ACTED] == 0.0
        error = loop.sense(p, s, y, spring)
        wheel, load = s[loop.LAST_MOTOR] / p[loop.GEAR], s[loop.LAST_LOAD]
        at = ESTIMATE + electric
        free = n - electric == 4
        # a held load is the origin of the wheel's angle
        origin = 0.0 if free else load
        if first:
            s[at] = wheel - origin
            if free:
                s[at + 2] = load
        _correct(p, s, wheel - origin, load, free)
        torque, friction, compensated = loop.prepared(p, s, y, spring)
        torque += friction
        forward = p[loop.PER_TORQUE] * torque + p[loop.PER_SPEED] * compensated
        stiffness = loop.table_tangent(spring, loop.table_deflection(spring, y[k.REFERENCE]))
        w = y[k.REFERENCE_RATE] / stiffness
        wanted = loop.table_deflection(spring, y[k.REFERENCE])
        base = forward
        if electric:
            base -= p[AT_K] * (s[ESTIMATE] - torque * p[PER_AMPERE])
        if free:
            base -= p[AT_K + electric] * (s[at] - s[at + 2] - wanted)
            base -= p[AT_K + electric + 1] * (s[at + 1] - w - s[at + 3])
            # what is left of the gains on the load's own motion, which the wheel follows
            base -= (p[AT_K + electric] + p[AT_K + electric + 2]) * s[at + 2]
            base -= (p[AT_K + electric + 1] + p[AT_K + electric + 3]) * s[at + 3]
        else:
            base -= p[AT_K + electric] * (s[at] - wanted)
            base -= p[AT_K + electric + 1] * (s[at + 1] - w)
        base -= p[AT_K + m] * (s[GIVEN] - forward)
        integral = s[SUM] + p[loop.T] * error
        asked = base - p[AT_K + m + 1] * integral
        if abs(asked) > p[loop.LIMIT] and asked * error > 0.0:
            integral = s[SUM]
            asked = base - p[AT_K + m + 1] * integral
        s[SUM] = integral
        loop.give(p, command, asked)

        _predict(p, s, command[k.COMMAND])

    return cfunc(k.CONTROLLER, cache=True, error_model="numpy")(lqg)
