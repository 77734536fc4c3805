"""Where the mismatch lives: in the machine, in time, and in the machine's states.

What no change of the nominal values can mimic is shared out over the ports, and followed over
time, speed, angle, load and temperature. Source: docs/diagnosis.md 6.1.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.locate.port_sensitivity import PortSensitivity, port_sensitivity
from rsea_core.identify.smoothing.separability import SUBSYSTEM
from rsea_core.identify.smoothing.smoother import Smoothed
from rsea_core.machine.rig import Rig
from rsea_core.numeric.arrays import read_only
from rsea_core.recordings.recording import Recording

BINS = 12  # of equal time in each quantity
CORRELATED_s = 0.05  # rows closer than this tell one thing
BLOCK_s = 0.25  # bootstrap blocks: longer than the predictor's memory
DRAWS = 200
TELLING = 0.25  # by how much a range must hold more of the mismatch than of the time
STILL_rad_per_s = 1e-3


@dataclass(frozen=True, kw_only=True)
class Concentration:
    """A range of a quantity that holds more of the mismatch than of the time.

    Attributes
    ----------
    quantity, unit : str
    low, high : float
    share, of_time : float
    se : float
        Of the share, by block bootstrap.
    """

    quantity: str
    unit: str
    low: float
    high: float
    share: float
    of_time: float
    se: float

    def sentence(self, part: str = "it") -> str:
        """The range as a sentence about the mismatch, or about a named part of it."""
        unit = f" {self.unit}" if self.unit else ""
        return (
            f"{100 * self.share:.0f} % of {part} lies where {self.quantity} is"
            f" {self.low:.3g} to {self.high:.3g}{unit}, {100 * self.of_time:.0f} % of the time"
        )


@dataclass(frozen=True, kw_only=True)
class Located:
    """What the recordings together say of where the mismatch arises.

    Attributes
    ----------
    shares : mapping of str to float
        By subsystem; they sum to one.
    members : mapping of str to tuple of str
        Of each name in `shares`, the subsystems that the readings cannot tell apart.
    shares_se : mapping of str to float
        By block bootstrap.
    level : float
        Root mean square of the mismatch, parameters projected out, in noise standard
        deviations; the noise itself is 1.
    parameters : mapping of str to float
        The best values of the rig's parameters without any missing physics, in tolerances.
    by_recording : tuple of (n,) arrays
        Mismatch of each row: the ports' torques over their own error bars, root mean square with
        the shares as weights. It stays where it happened.
    concentrations : tuple of Concentration
        Most telling first.
    residual : tuple of Smoothed
        The recordings' port torques without what those parameters explain.
    """

    shares: Mapping[str, float]
    members: Mapping[str, tuple[str, ...]]
    shares_se: Mapping[str, float]
    level: float
    parameters: Mapping[str, float]
    by_recording: tuple[NDArray, ...]
    concentrations: tuple[Concentration, ...]
    residual: tuple[Smoothed, ...]

    @property
    def subsystem(self) -> str:
        """The subsystem with the largest share."""
        return max(self.shares, key=self.shares.get)

    def port_shares(self) -> dict[str, float]:
        """Shares by port: that of the environment belongs to the load's."""
        found: dict[str, float] = {}
        port_of = {subsystem: port for port, subsystem in SUBSYSTEM.items()} | {"environment": "L"}
        for name, share in self.shares.items():
            known = {port_of[member] for member in self.members[name]}
            carried = {p for s in self.residual for p in s.ports}
            port = next((p for p in "GLVS" if p in known & carried), None)
            if port is not None:
                found[port] = found.get(port, 0.0) + share
        return found

    def where(self) -> str:
        """In words."""
        if not self.concentrations:
            return "spread evenly over time, speed, angle and load"
        return "; ".join(c.sentence() for c in self.concentrations[:3])


def locate(
    rig: Rig, recordings: Sequence[Recording], smoothed: Sequence[Smoothed], *, seed: int = 0
) -> Located:
    """Share out the mismatch of smoothed recordings over ports, time and states.

    Parameters
    ----------
    recordings, smoothed : sequences of the same length
        Moving recordings and what `smooth` made of them.
    seed : int
        Of the bootstrap.

    Raises
    ------
    InputError, RigError
        As `smooth`.
    """
    responses = [port_sensitivity(rig, r, s) for r, s in zip(recordings, smoothed, strict=True)]
    parameters, left = _without_parameters(responses, [r.sample_time_s for r in recordings])
    rows = [_owners(s) for s in smoothed]
    members = {name: part for s in smoothed for name, part in _members(s).items()}
    contributions = [_contributions(p, owner, members) for p, owner in zip(left, rows, strict=True)]
    blocks = [
        _blocked(c, max(1, round(BLOCK_s / r.sample_time_s)))
        for c, r in zip(contributions, recordings, strict=True)
    ]
    names = sorted({name for c in contributions for name in c})
    table = np.array(
        [[block.get(name, 0.0) for name in names] for part in blocks for block in part]
    )
    shares, se = _shares(table, seed)
    left_power = [np.square(sum(p.by_port.values())) for p in left]
    count = sum(v.size for v in left_power)
    residual = [_residual(s, r, parameters) for s, r in zip(smoothed, responses, strict=True)]
    named = dict(zip(names, shares, strict=True))
    power = [_row_power(s, owner, named) for s, owner in zip(residual, rows, strict=True)]
    return Located(
        shares=named,
        members=members,
        shares_se=dict(zip(names, se, strict=True)),
        level=float(np.sqrt(sum(v.sum() for v in left_power) / count)),
        parameters=parameters,
        by_recording=tuple(np.sqrt(v) for v in power),
        concentrations=_concentrations(recordings, smoothed, power, seed),
        residual=tuple(residual),
    )


def _without_parameters(
    responses: Sequence[PortSensitivity], row_s: Sequence[float]
) -> tuple[dict[str, float], list[PortSensitivity]]:
    """The best parameters, and every port's response with what they mimic taken out.

    Ridge regression with each tolerance as prior, against what is left as noise and with rows
    counted once per memory of the predictor: a value may go several tolerances where the
    recordings ask for it, and may not where missing physics would only like it to.
    """
    names = sorted({name for r in responses for name in r.by_parameter})
    ports = sorted({port for r in responses for port in r.by_port})
    gram = np.zeros((len(names), len(names)))
    right = np.zeros((len(names), len(ports) + 2))
    for r, step in zip(responses, row_s, strict=True):
        X = _columns(r, names)
        weight = min(1.0, step / CORRELATED_s)
        gram += weight * (X.T @ X)
        for j, port in enumerate(ports):
            if port in r.by_port:
                right[:, j] += weight * (X.T @ r.by_port[port].ravel())
        right[:, -2] += weight * (X.T @ r.unrepeated.ravel())
        right[:, -1] += weight * (X.T @ r.total.ravel())
    power = sum(float(np.sum(np.square(r.total))) for r in responses)
    count = sum(r.total.size for r in responses)
    noise = max(1.0, power / count)
    for _ in range(3):
        solved = np.linalg.solve(gram + noise * np.eye(len(names)), right)
        best = solved[:, -1]
        left_power = sum(
            float(np.sum(np.square(r.total.ravel() - _columns(r, names) @ best))) for r in responses
        )
        noise = max(1.0, left_power / count)
    left = []
    for r in responses:
        X = _columns(r, names)
        by_port = {
            port: v - (X @ solved[:, ports.index(port)]).reshape(v.shape)
            for port, v in r.by_port.items()
        }
        total = r.total - (X @ solved[:, -1]).reshape(r.total.shape)
        unrepeated = r.unrepeated - (X @ solved[:, -2]).reshape(r.total.shape)
        left.append(replace(r, total=total, by_port=by_port, unrepeated=unrepeated))
    return dict(zip(names, solved[:, -1], strict=True)), left


def _residual(found: Smoothed, r: PortSensitivity, parameters: Mapping[str, float]) -> Smoothed:
    """Port torques less what the best parameters put there (ports that are not carried aside)."""
    ports = {port: values.copy() for port, values in found.ports.items()}
    for name, acting in r.signals.items():
        for port, values in acting:
            if port in ports:
                ports[port] -= parameters[name] * values
    return replace(found, ports={port: read_only(v) for port, v in ports.items()})


def _row_power(
    found: Smoothed, owner: Mapping[str, NDArray], shares: Mapping[str, float]
) -> NDArray:
    power = np.zeros(found.time_s.size)
    for port, values in found.ports.items():
        share = np.array([shares[name] for name in owner[port]])
        power += share * np.square(values / np.maximum(found.ports_std[port], 1e-300))
    return power


def _columns(r: PortSensitivity, names: Sequence[str]) -> NDArray:
    zero = np.zeros(r.total.size)
    found = [r.by_parameter[n].ravel() if n in r.by_parameter else zero for n in names]
    return np.column_stack(found) if found else np.zeros((r.total.size, 0))


def _class_of(found: Smoothed, port: str) -> tuple[str, ...]:
    """The subsystems whose torque a port carries, upstream first."""
    ports = {port, *dict(found.separability.merged)[port]} - {"E"}
    return tuple(SUBSYSTEM[p] for p in sorted(ports, key="VGSL".index))


def _name(members: tuple[str, ...]) -> str:
    return " or ".join(members)


def _members(found: Smoothed) -> dict[str, tuple[str, ...]]:
    """Subsystems by the name that they have together."""
    classes = [_class_of(found, port) for port in found.ports]
    return {_name(c): c for c in classes} | {"environment": ("environment",)}


def _owners(found: Smoothed) -> dict[str, NDArray]:
    """Which subsystem a port's torque belongs to, row by row."""
    owner = {}
    for port in found.ports:
        name = _name(_class_of(found, port))
        owner[port] = np.full(found.time_s.size, name, dtype=object)
        if port == "L" and found.in_contact.any():
            owner[port][found.in_contact] = "environment"
    return owner


def _contributions(
    r: PortSensitivity, owner: Mapping[str, NDArray], members: Mapping[str, tuple[str, ...]]
) -> dict[str, NDArray]:
    """By subsystem, each row's part of the squared mismatch; cross terms divided evenly."""
    whole = sum(r.by_port.values())
    found: dict[str, NDArray] = {}
    for port, values in r.by_port.items():
        part = np.sum(values * whole, axis=1)
        if "drive" in members[owner[port][0]]:
            part = part - np.mean(np.sum(np.square(r.unrepeated), axis=1))
        for name in set(owner[port]):
            rows = np.where(owner[port] == name, part, 0.0)
            found[name] = found.get(name, 0.0) + rows
    return found


def _blocked(contributions: Mapping[str, NDArray], length: int) -> list[dict[str, float]]:
    n = next(iter(contributions.values())).size
    starts = np.arange(0, n, length)
    sums = {name: np.add.reduceat(v, starts) for name, v in contributions.items()}
    return [{name: float(v[k]) for name, v in sums.items()} for k in range(starts.size)]


def _shares(table: NDArray, seed: int) -> tuple[NDArray, NDArray]:
    """Shares and their standard errors; negative ones (cross terms of nothing) are zero."""
    rng = np.random.default_rng(seed)
    draws = rng.integers(0, len(table), (DRAWS, len(table)))

    def share(sums: NDArray) -> NDArray:
        positive = np.maximum(sums, 0.0)
        return positive / np.maximum(positive.sum(axis=-1, keepdims=True), 1e-300)

    return share(table.sum(axis=0)), share(table[draws].sum(axis=1)).std(axis=0)


def state_quantities(recording: Recording, found: Smoothed) -> dict[tuple[str, str], NDArray]:
    """What the mismatch may depend on, by (words, unit)."""
    s = found.signals
    quantities = {("the wheel's speed", "rad/s"): s.get("wheel_velocity_rad_per_s")}
    if "load_velocity_rad_per_s" in s:
        quantities["the load's speed", "rad/s"] = s["load_velocity_rad_per_s"]
    if "load_angle_rad" in s:
        quantities["the load's angle", "rad"] = s["load_angle_rad"]
    if "torque_Nm" in s:
        quantities["the spring's torque", "Nm"] = s["torque_Nm"]
        quantities["the deflection", "rad"] = s["spring_deflection_rad"]
    if "current_A" in s:
        quantities["the current", "A"] = s["current_A"]
    if "temperature_C" in recording:
        quantities["the case's temperature", "degrees C"] = recording["temperature_C"]
    quantities["the time since the wheel last turned back", "s"] = since_reversal(
        found.time_s, s["wheel_velocity_rad_per_s"]
    )
    return {name: v for name, v in quantities.items() if v is not None}


def since_reversal(time_s: NDArray, speed: NDArray) -> NDArray:
    """Time since the last change of direction, counted from the start before the first one."""
    sign = np.sign(np.where(np.abs(speed) > STILL_rad_per_s, speed, 0.0))
    last = np.maximum.accumulate(np.where(sign != 0.0, np.arange(sign.size), 0))
    turned = np.concatenate(([False], sign[last][1:] * sign[last][:-1] < 0.0))
    start = np.maximum.accumulate(np.where(turned, np.arange(sign.size), 0))
    return time_s - time_s[start]


def _concentrations(
    recordings: Sequence[Recording],
    smoothed: Sequence[Smoothed],
    power: Sequence[NDArray],
    seed: int,
) -> tuple[Concentration, ...]:
    pooled: dict[tuple[str, str], list[tuple[NDArray, NDArray, int]]] = {}
    for r, s, p in zip(recordings, smoothed, power, strict=True):
        length = max(1, round(BLOCK_s / r.sample_time_s))
        for name, values in state_quantities(r, s).items():
            pooled.setdefault(name, []).append((values, p, length))
    return concentrations(pooled, seed)


def concentrations(
    pooled: Mapping[tuple[str, str], Sequence[tuple[NDArray, NDArray, int]]], seed: int
) -> tuple[Concentration, ...]:
    """Ranges of quantities that hold more of a weight than of the time, most telling first.

    Parameters
    ----------
    pooled : mapping of (words, unit) to (values (n,), weight (n,), rows of a block) by recording
    seed : int
        Of the block bootstrap.
    """
    rng = np.random.default_rng(seed)
    found = []
    for (name, unit), parts in pooled.items():
        values = np.concatenate([v for v, _, _ in parts])
        weight = np.concatenate([p for _, p, _ in parts])
        block = np.concatenate(
            [np.arange(v.size) // length + 1e6 * k for k, (v, _, length) in enumerate(parts)]
        )
        best = _best_range(values, weight)
        if best is None or best[2] - best[3] < TELLING:
            continue
        low, high, share, of_time = best
        inside = (values >= low) & (values <= high)
        _, member = np.unique(block, return_inverse=True)
        within = np.bincount(member, weight * inside)
        whole = np.bincount(member, weight)
        draws = rng.integers(0, whole.size, (DRAWS, whole.size))
        resampled = within[draws].sum(axis=1) / np.maximum(whole[draws].sum(axis=1), 1e-300)
        se = float(resampled.std())
        if share - of_time > 3.0 * se:
            found.append(
                Concentration(
                    quantity=name, unit=unit, low=float(low), high=float(high),
                    share=float(share), of_time=float(of_time), se=se,
                )
            )  # fmt: skip
    return tuple(sorted(found, key=lambda c: c.of_time - c.share))


def _best_range(values: NDArray, weight: NDArray) -> tuple[float, float, float, float] | None:
    """The run of equal-time bins whose share of the weight exceeds its share of time most."""
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, BINS + 1)))
    if edges.size < 3 or not weight.sum() > 0.0:
        return None
    index = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, edges.size - 2)
    share = np.bincount(index, weight, edges.size - 1) / weight.sum()
    time = np.bincount(index, minlength=edges.size - 1) / values.size
    excess = np.concatenate(([0.0], np.cumsum(share - time)))
    first, last, most = 0, 0, 0.0
    for a in range(edges.size - 1):
        b = a + 1 + int(np.argmax(excess[a + 1 :]))
        if excess[b] - excess[a] > most:
            first, last, most = a, b, float(excess[b] - excess[a])
    if last == first:
        return None
    return edges[first], edges[last], share[first:last].sum(), time[first:last].sum()
