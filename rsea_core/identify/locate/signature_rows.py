"""A port's torque over all recordings, and how a statistic of it gets its standard error."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.smoothing.quasi_static_ports import PortTorques
from rsea_core.recordings.recording import Recording

BLOCK_s = 0.5
DRAWS = 200
MOTION = {
    "wheel": "wheel_velocity_rad_per_s",
    "load": "load_velocity_rad_per_s",
    "deflection": "deflection_velocity_rad_per_s",
}
WHAT = {
    "V": "drive's missing voltage",
    "G": "gear's missing torque",
    "S": "spring's missing torque",
    "L": "load's missing torque",
}
OWN_MOTION = {"V": "wheel", "G": "wheel", "S": "deflection", "L": "load"}


@dataclass(frozen=True, kw_only=True)
class Signature:
    """One statistic of one port.

    Attributes
    ----------
    name, port, unit, sentence : str
    value, se : float
    details : mapping of str to float
    """

    name: str
    port: str
    value: float
    se: float
    unit: str
    sentence: str
    details: Mapping[str, float]

    @property
    def z(self) -> float:
        """Value in standard errors."""
        return self.value / self.se if self.se > 0.0 else 0.0


@dataclass(frozen=True, kw_only=True)
class PortRows:
    """One port's torque over all recordings that have it, with the states beside it."""

    port: str
    torque: NDArray
    time_s: NDArray
    row_s: NDArray
    recording: NDArray  # number of the recording of each row
    signals: Mapping[str, NDArray]

    def blocks(self) -> NDArray:
        """Number of the bootstrap block of each row."""
        within = np.floor(self.time_s / BLOCK_s).astype(int)
        _, found = np.unique(self.recording * 1_000_000 + within, return_inverse=True)
        return found


def port_rows(
    port: str, recordings: Sequence[Recording], found: Sequence[PortTorques]
) -> PortRows | None:
    """The rows of a port, None where no recording has it."""
    parts = [(k, r, f) for k, (r, f) in enumerate(zip(recordings, found, strict=True))]
    parts = [(k, r, f) for k, r, f in parts if port in f.ports]
    if not parts:
        return None
    tables = [_signals(r, f) for _, r, f in parts]
    common = set.intersection(*(set(t) for t in tables))
    return PortRows(
        port=port,
        torque=np.concatenate([f.ports[port] for _, _, f in parts]),
        time_s=np.concatenate([f.time_s - f.time_s[0] for _, _, f in parts]),
        row_s=np.concatenate([np.full(f.time_s.size, r.sample_time_s) for _, r, f in parts]),
        recording=np.concatenate([np.full(f.time_s.size, k) for k, _, f in parts]),
        signals={name: np.concatenate([t[name] for t in tables]) for name in common},
    )


def _signals(recording: Recording, found: PortTorques) -> dict[str, NDArray]:
    s = dict(found.signals)
    if "wheel_velocity_rad_per_s" in s and "spring_deflection_rad" in s:
        load = s.get("load_velocity_rad_per_s", 0.0)
        s["deflection_velocity_rad_per_s"] = s["wheel_velocity_rad_per_s"] - load
    for name in ("motor_angle_rad", "temperature_C", recording.command_name):
        if name in recording:
            s[name] = recording[name]
    if recording.command_name is not None:
        s["command"] = recording[recording.command_name]
    return s


def slope_of(
    x: NDArray, y: NDArray, block: NDArray, rng: np.random.Generator, extra: NDArray | None = None
) -> tuple[float, float, float]:
    """Slope of y on x (a constant and `extra` beside it), its block-bootstrap error, and the share
    of y's variance that it explains."""
    X = np.column_stack([x, np.ones_like(x), *([] if extra is None else [extra])])
    _, member = np.unique(block, return_inverse=True)
    pairs = [(i, j) for i in range(X.shape[1]) for j in range(X.shape[1])]
    grams = np.array([np.bincount(member, X[:, i] * X[:, j]) for i, j in pairs]).T
    rights = np.array([np.bincount(member, X[:, i] * y) for i in range(X.shape[1])]).T
    shape = (X.shape[1], X.shape[1])
    ridge = 1e-12 * np.diag(np.maximum(np.sum(X**2, axis=0), 1e-300))

    def slope(pick: NDArray) -> float:
        gram = grams[pick].sum(axis=0).reshape(shape) + ridge
        return float(np.linalg.solve(gram, rights[pick].sum(axis=0))[0])

    value = slope(np.arange(len(grams)))
    explained = value**2 * float(np.var(x)) / max(float(np.var(y)), 1e-300)
    return value, float(spread_of(slope, len(grams), rng)), explained


def spread_of(statistic: Callable, count: int, rng: np.random.Generator) -> NDArray:
    """Standard deviation of a statistic over resampled units."""
    return np.std([statistic(rng.integers(0, count, count)) for _ in range(DRAWS)], axis=0)


def unit_of(port: str) -> str:
    return "V" if port == "V" else "Nm"
