"""A torque of unknown shape at each port: what no named law can say, and where it enters.

The shape is a sum of hats over one signal of the smoothed motion (angle, speed, deflection,
current, command), its response that of the linear errors' machine. Its held-out gain is judged as
those of named laws are (`screening`): where it is much the larger, the law is not among them.
"""

from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.linalg import expm

import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp
from rsea_core.engines.linear.linearise import linear_plant
from rsea_core.identify.candidates.angle_relation import angle_relation
from rsea_core.identify.fitting.problem import machine_of
from rsea_core.identify.law_search.screening import Projection
from rsea_core.identify.multistep.tracks import Track
from rsea_core.identify.smoothing.error_model import one_body
from rsea_core.machine.rig import is_linear

HATS, FRICTION_HATS = 7, 15
SPEED_OF = {"wheel angle": k.WW, "load angle": k.WL}  # which friction over that angle opposes
PORTS = {"G": "gear", "L": "load", "S": "spring", "V": "drive"}


@dataclass(frozen=True, kw_only=True)
class Shape:
    """An unknown torque (or voltage) as a function of one signal.

    Attributes
    ----------
    port, signal : str
    friction : bool
        Whether the torque opposes the motion: the function is then its size.
    nodes, values : (h,) arrays
        The function, in Nm at the output or in V.
    held_out, deviation, gain : float
        As of a `Candidate`.
    is_linear : bool
        Whether the axis is: forces in N.
    """

    port: str
    signal: str
    nodes: NDArray
    values: NDArray
    gain: float
    held_out: float
    deviation: float
    friction: bool = False
    is_linear: bool = False

    def sentence(self) -> str:
        """Where it enters, on what it depends, how large it is."""
        what, unit = ("force", "N") if self.is_linear else ("torque", "Nm")
        what, unit = ("voltage", "V") if self.port == "V" else (what, unit)
        size = float(np.ptp(self.values))
        where = {"G": "at the gear", "L": "on the load", "S": "in the spring",
                 "V": "at the winding"}[self.port]  # fmt: skip
        what = "friction" if self.friction else f"a {what}"
        return f"{what} {where} that follows the {self.signal}, {size:.3g} {unit} over its range"

    @property
    def subsystem(self) -> str:
        """Part of the machine; the drive, if the shape depends on command or current."""
        return "drive" if self.signal in ("command", "current") else PORTS[self.port]


def shapes(projection: Projection) -> list[Shape]:
    """Shapes at all ports over all signals, the largest held-out gain first.

    None in a spring that the readings show to be linear.
    """
    tracks, found = projection.estimator.tracks, []
    relation = angle_relation(projection.estimator.problem.case)
    linear = relation is not None and relation.spring_is_linear
    for port in ports(tracks[0]):
        if port == "S" and linear:
            continue
        scale = max(_scale(t, port) for t in tracks)  # one function for all recordings
        for signal, friction in _signals(tracks[0], port):
            values = [_signal(t, signal) for t in tracks]
            both = np.concatenate(values)
            hats = np.linspace(0.02, 0.98, FRICTION_HATS if friction else HATS)
            nodes = np.unique(np.quantile(both, hats))
            if nodes.size < 4:
                continue
            parts = []
            for t, v in zip(tracks, values, strict=True):
                sign = -np.sign(t.motion[:, SPEED_OF[signal]]) if friction else 1.0
                hats = [np.interp(v, nodes, height) for height in np.eye(nodes.size)]
                parts.append(responses(t, port, scale * sign * np.array(hats)))
            judged = projection.judged(projection.columns(parts))
            if judged is None:
                continue
            size, gain, held_out, deviation = judged
            found.append(
                Shape(port=port, signal=signal, nodes=nodes, values=scale * size, gain=gain,
                      held_out=held_out, deviation=deviation, friction=friction,
                      is_linear=is_linear(projection.estimator.problem.case.rig))
            )  # fmt: skip
    return sorted(found, key=lambda s: -s.held_out)


def _scale(t: Track, port: str) -> float:
    """Typical torque [Nm] or voltage [V] at a port."""
    return float(t.scale.voltage_V if port == "V" else t.scale.torque_Nm[int(port == "L")])


def ports(t: Track) -> tuple[str, ...]:
    """Where an unknown torque or voltage can enter this machine."""
    plant = machine_of(t.experiment.base)
    if plant.structure == mp.RIGID_HELD:
        return ()
    found = ["G"] if plant.drive != mp.NO_DRIVE else []
    if plant.structure == mp.ELASTIC_FREE:
        found += ["L", "S"]
    elif plant.structure == mp.ELASTIC_HELD:
        found.append("S")
    elif plant.drive == mp.NO_DRIVE:
        found.append("L")
    if plant.drive in (mp.DUTY, mp.VOLTAGE):
        found.append("V")
    return tuple(found)


def _signals(t: Track, port: str) -> list[tuple[str, bool]]:
    """Signals that a shape may follow, and whether as friction."""
    plant = machine_of(t.experiment.base)
    body = {"G": ("wheel speed", "wheel angle", "current"), "L": ("load speed", "load angle"),
            "S": ("deflection", "deflection rate"), "V": ("current",)}[port]  # fmt: skip
    more = ("command",) if t.experiment.recording.command_name and port in "GV" else ()
    if port == "G" and plant.structure == mp.RIGID_FREE:
        more = (*more, "load angle")
    plain = [(signal, False) for signal in (*body, *more)]
    return plain + [(signal, True) for signal in body if signal in SPEED_OF]


def _signal(t: Track, name: str) -> NDArray:
    m = t.motion
    if name == "command":
        r = t.experiment.recording
        return np.asarray(r[r.command_name])
    return {
        "wheel speed": m[:, k.WW], "wheel angle": m[:, k.TW], "load speed": m[:, k.WL],
        "load angle": m[:, k.TL], "deflection": m[:, k.TW] - m[:, k.TL],
        "deflection rate": m[:, k.WW] - m[:, k.WL], "current": m[:, k.IM],
    }[name]  # fmt: skip


def responses(t: Track, port: str, signals: NDArray) -> NDArray:
    """Changes (m, blocks, p) of the innovations by signals (m, n) at a port, one at a time."""
    errors, plant = t.errors, t.plant
    states, h = errors.states, t.experiment.recording.sample_time_s * t.block
    signals = t.averaged(signals[:, :, None])[:, :, 0]
    d, n = errors.A.shape[1], len(states)
    b = np.zeros(d)
    rigid = plant.structure == mp.RIGID_FREE
    wheel = plant.inertia + (plant.load_inertia if rigid else 0.0)
    if k.WW not in states or (port == "L" and k.WL not in states and not rigid):
        return np.zeros((len(signals), t.blocks, len(t.experiment.channels)))
    if port == "V":
        if k.IM in states:
            b[states.index(k.IM)] = 1.0 / plant.inductance
        else:
            b[states.index(k.WW)] = plant.torque_per_ampere / plant.resistance / wheel
    elif port == "G" or (port == "L" and rigid):
        b[states.index(k.WW)] = 1.0 / wheel
    elif port == "L":
        b[states.index(k.WL)] = 1.0 / plant.load_inertia
    else:
        b[states.index(k.WW)] = -1.0 / plant.inertia
        if k.WL in states:
            b[states.index(k.WL)] = 1.0 / plant.load_inertia
    B = np.zeros((len(errors.A), d))
    for j in np.unique(errors.mode):
        full = linear_plant(
            plant, tangent=t.stiffness,
            gravity_stiffness=plant.gravity * (-1.0 + 2.0 * (j % 5) / 4.0), in_contact=bool(j >= 5),
        ).A  # fmt: skip
        full = one_body(full) if rigid else full
        M = np.zeros((d + 1, d + 1))
        M[:n, :n] = full[np.ix_(states, states)]
        M[:d, d] = b
        B[j] = expm(M * h)[:d, d]
    direct = np.zeros(len(t.experiment.channels))
    if port == "S" and "torque_Nm" in t.experiment.channels:
        direct[t.experiment.channels.index("torque_Nm")] = 1.0
    residuals = np.zeros((*signals.shape, len(t.experiment.channels)))
    _respond(errors.A, B, errors.mode, errors.C, t.begins, signals, direct, residuals)
    return replace(t, block=1).innovations(residuals)


@njit(cache=True, nogil=True, error_model="numpy")
def _respond(A, B, mode, C, begins, signals, direct, out):
    m, n, p = out.shape
    d = A.shape[1]
    x, after = np.zeros(d), np.zeros(d)
    for j in range(m):
        for t in range(n):
            if begins[t]:
                x[:] = 0.0
            for i in range(p):
                s = direct[i] * signals[j, t]
                for a in range(d):
                    s += C[i, a] * x[a]
                out[j, t, i] = -s
            now = mode[t]
            for a in range(d):
                s = B[now, a] * signals[j, t]
                for b in range(d):
                    s += A[now, a, b] * x[b]
                after[a] = s
            x, after = after, x
