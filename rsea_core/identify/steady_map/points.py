"""A map of steady speeds: the torque that turns a machine, point by point, and its friction laws.

Recordings of a machine that turns steadily are not replayed: every speed is one point of a map,
the mean of its rows, with a standard error from blocks of them. On the motor's side

    torque - load = viscous w + s level + ...        s = sgn w

level is the sliding friction, one or one for each direction, with a Stribeck part that falls
exponentially with the speed, and drag that grows with its square. Where the load passes torque
through the gear, friction that grows with it is larger where the motor drives the load than where
the load helps; with one load level that is the same map as a friction that differs by direction,
and only the efficiencies of the whole drive at that load are known. Laws are compared by
leave-one-speed-out errors in the unit of each point's standard error, between speeds that stay
(an end left out asks for an extrapolation that no law is chosen for).

Sources: Armstrong-Helouvry et al., Automatica 30 (1994) 1083 (Stribeck); Shigley, Mechanical
Engineering Design, worm gears (drive and back-drive); Allen, Technometrics 16 (1974) 125 (PRESS).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RecordingError
from rsea_core.identify.friction.data import STEADY_BLOCKS, motor_torque
from rsea_core.machine.rig import Rig
from rsea_core.recordings.case import Case
from rsea_core.recordings.recording import Recording

FLOOR = 0.005  # of the largest torque: no mean of a machine repeats better than this
AT_REST = 2.0  # standard errors of a mean speed within which it counts as none
SHAPES = (1.0, 2.0)  # powers of the speed in the Stribeck exponent
SPEEDS = 40  # Stribeck speeds tried
ONE_LOAD = 0.05  # relative spread of load torques that counts as one level
FEWEST = 6  # points


@dataclass(frozen=True, kw_only=True)
class SteadyPoints:
    """The map, (n,) arrays on the motor side, by rising speed.

    Attributes
    ----------
    file : tuple of str
    speed_rad_per_s, torque_Nm, error_Nm : array
        Means of each point and the standard error of its torque.
    load_Nm : array
        Torque through the gear, positive where it resists positive motion.
    known_Nm : array
        What the rig file expects: load and viscous friction.
    held_out : array of bool
    """

    file: tuple[str, ...]
    speed_rad_per_s: NDArray
    torque_Nm: NDArray
    error_Nm: NDArray
    load_Nm: NDArray
    known_Nm: NDArray
    held_out: NDArray

    @property
    def one_load(self) -> bool:
        """Whether the gear carries the same torque in all points."""
        size = np.abs(self.load_Nm)
        return bool(np.ptp(size) <= ONE_LOAD * max(size.max(), 1e-300))

    @property
    def driven(self) -> NDArray:
        """Where the motor drives the load, against the load being a help."""
        return np.sign(self.speed_rad_per_s) * self.load_Nm > 0.0


@dataclass(frozen=True, kw_only=True)
class MapLaw:
    """What friction may be made of.

    Attributes
    ----------
    levels : str
        "none", "one", "two" (by direction), "load" (grows with the load's torque).
    stribeck : str
        "none", "one", "two" (by direction), "skew" (only the difference of the directions).
    drag : str
        "v" (viscous), "q" (with the square of the speed), "vq".
    """

    levels: str
    stribeck: str
    drag: str

    @property
    def name(self) -> str:
        """In words."""
        phrase = {
            "none": "no dry friction", "one": "Coulomb", "two": "Coulomb by direction",
            "load": "Coulomb and load-dependent",
        }  # fmt: skip
        stribeck = {"none": "", "one": ", Stribeck"}.get(self.stribeck, ", Stribeck by direction")
        drag = {"v": "viscous", "q": "quadratic drag", "vq": "viscous, quadratic drag"}
        return f"{phrase[self.levels]}{stribeck}, {drag[self.drag]}"

    @property
    def names(self) -> tuple[str, ...]:
        """Of the columns."""
        found = {"v": ("viscous",), "q": ("quadratic",), "vq": ("viscous", "quadratic")}[self.drag]
        found += {
            "none": (), "one": ("level",), "two": ("level", "skew"),
            "load": ("level", "driven", "helped"),
        }[self.levels]  # fmt: skip
        return found + {
            "none": (), "one": ("peak",), "two": ("peak", "peak_skew"), "skew": ("peak_skew",),
        }[self.stribeck]  # fmt: skip

    def columns(self, p: SteadyPoints, stribeck: float, shape: float) -> NDArray:
        """(n, k) matrix whose coefficients are the law's values."""
        w, size, load = p.speed_rad_per_s, np.abs(p.speed_rad_per_s), np.abs(p.load_Nm)
        s, peak = np.sign(w), np.exp(-((size / stribeck) ** shape))
        every = {
            "viscous": w, "quadratic": w * size, "level": s, "skew": np.ones(w.size),
            "driven": s * load * p.driven, "helped": s * load * ~p.driven, "peak": s * peak,
            "peak_skew": peak,
        }  # fmt: skip
        return np.stack([every[name] for name in self.names], axis=1)


@dataclass(frozen=True, kw_only=True)
class MapFit:
    """A law fitted to the points that may be fitted.

    Attributes
    ----------
    values, std : mapping of column name -> value, standard deviation
    covariance : (k, k) array
    stribeck_rad_per_s, shape : float
    left_Nm : (n,) array
        Torque less prediction of every point, held-out ones too.
    score : float
        Root mean square leave-one-out error in standard errors.
    """

    law: MapLaw
    values: dict[str, float]
    std: dict[str, float]
    covariance: NDArray
    stribeck_rad_per_s: float
    shape: float
    left_Nm: NDArray
    score: float

    def friction(self, p: SteadyPoints) -> NDArray:
        """Friction torque at points [Nm]."""
        X = self.law.columns(p, self.stribeck_rad_per_s, self.shape)
        return X @ np.array([self.values[name] for name in self.law.names])


def is_steady_map(case: Case) -> bool:
    """Whether the case is a map of steady speeds: quasi-static recordings of a turning drive."""
    return all(
        r.quasi_static and "motor_velocity_rad_per_s" in r and not r.load.is_held
        for r in case.identification
    ) and case.rig.has("drive")


def steady_points(case: Case) -> SteadyPoints:
    """The map of a case.

    A recording whose speed stays is one point; one whose speed changes from row to row is a map
    itself, every row a point.

    Raises
    ------
    RecordingError
        If a recording has no motor torque, or too few speeds are left.
    """
    rows: list[tuple] = []
    for r in case.recordings:
        if not r.quasi_static or "motor_velocity_rad_per_s" not in r:
            continue
        if not {"motor_torque_Nm", "current_A", "current_command_A", "duty"} & r.columns.keys():
            raise RecordingError(
                f"{r.file}: a map of steady speeds needs a motor torque (motor_torque_Nm,"
                " current_A, or duty with the rig's resistance)"
            )
        rows += _points_of(case.rig, r)
    # standard errors that a few blocks give scatter; a machine's typical one steadies them
    error = np.array([row[3] for row in rows])
    typical = float(np.median(error)) if error.size else 0.0
    order = np.argsort([row[1] for row in rows], kind="stable")
    chosen = [rows[j] for j in order]
    columns = [np.array([row[j] for row in chosen]) for j in range(1, 7)]
    speed, torque, error, load, known, unsure = columns
    moving = np.abs(speed) > AT_REST * unsure
    floor = FLOOR * np.abs(torque).max() if torque.size else 0.0
    error = np.sqrt(0.5 * error**2 + 0.5 * typical**2 + floor**2)
    held = np.array([row[7] for row in chosen], dtype=bool)
    if np.sum(moving & ~held) < FEWEST:
        raise RecordingError(
            f"case {case.name!r}: {int(np.sum(moving & ~held))} steady speeds to fit are fewer"
            f" than {FEWEST}"
        )
    return SteadyPoints(
        file=tuple(row[0] for row, m in zip(chosen, moving, strict=True) if m),
        speed_rad_per_s=speed[moving], torque_Nm=torque[moving], error_Nm=error[moving],
        load_Nm=load[moving], known_Nm=known[moving], held_out=held[moving],
    )  # fmt: skip


def _points_of(rig: Rig, r: Recording) -> list[tuple]:
    speed, torque = r["motor_velocity_rad_per_s"], motor_torque(rig, r, _mean_rows(r))
    load = _load(rig, r)
    viscous = (rig.motor_viscous_Nms_per_rad or 0.0) + (
        rig.output_viscous_Nms_per_rad or 0.0
    ) / _ratio(rig) ** 2
    held = r.role == "validation"
    if is_one_speed(speed):
        blocks = np.array_split(torque, STEADY_BLOCKS)
        error = np.std([b.mean() for b in blocks], ddof=1) / np.sqrt(STEADY_BLOCKS)
        turned = [b.mean() for b in np.array_split(speed, STEADY_BLOCKS)]
        unsure = np.std(turned, ddof=1) / np.sqrt(STEADY_BLOCKS)
        w, tau = float(speed.mean()), float(load.mean())
        known = tau + viscous * w
        return [(r.file, w, float(torque.mean()), float(error), tau, known, unsure, held)]
    rough = float(np.median(np.abs(np.diff(torque)))) / 1.35  # of neighbours on a smooth map
    return [
        (r.file, w, t, rough, tau, tau + viscous * w, 0.0, held)
        for w, t, tau in zip(speed, torque, load, strict=True)
    ]


def is_one_speed(speed: NDArray) -> bool:
    """Whether rows are readings of one steady speed: no drift beyond what their noise makes.

    An encoder shows a slow speed in steps, so that rows scatter widely about a steady mean.
    """
    blocks = np.array([b.mean() for b in np.array_split(speed, STEADY_BLOCKS)])
    scatter = float(np.std(speed)) / np.sqrt(max(speed.size / STEADY_BLOCKS, 1.0))
    return bool(np.ptp(blocks) <= 6.0 * scatter + 0.02 * abs(speed.mean()))


def _mean_rows(r: Recording) -> NDArray:
    speed = r["motor_velocity_rad_per_s"]
    return np.full(speed.size, speed.mean()) if is_one_speed(speed) else speed


def _ratio(rig: Rig) -> float:
    return rig.gear_ratio or 1.0


def _load(rig: Rig, r: Recording) -> NDArray:
    """Torque through the gear on the motor's side, positive against positive motion."""
    if "torque_Nm" in r and "torque_Nm" not in r.derived:
        return r["torque_Nm"] / _ratio(rig)
    if r.load.kind == "constant-torque":
        return np.full(r.rows, -r.load.load_torque_Nm / _ratio(rig))
    return np.zeros(r.rows)


def candidate_laws(p: SteadyPoints) -> list[MapLaw]:
    """Laws that these points can be asked about, viscous friction alone first."""
    both = bool(np.any(p.speed_rad_per_s > 0.0) and np.any(p.speed_rad_per_s < 0.0))
    levels = ["one", *(["two"] if both else [])]
    if not p.one_load:
        levels.append("load")
    found = [MapLaw(levels="none", stribeck="none", drag=drag) for drag in ("v", "q", "vq")]
    for level in levels:
        for stribeck in ("none", "one", *(("two", "skew") if both and level != "one" else ())):
            found += [MapLaw(levels=level, stribeck=stribeck, drag=d) for d in ("v", "q", "vq")]
    return found


def fit_law(p: SteadyPoints, law: MapLaw) -> MapFit:
    """Weighted least squares, Stribeck speed and shape from a grid, leave-one-out in closed form.

    The grid is searched anew for every point that is left out.
    """
    used = np.flatnonzero(~p.held_out)
    weight = 1.0 / p.error_Nm[used]
    y = (p.torque_Nm - p.load_Nm)[used] * weight
    size = np.abs(p.speed_rad_per_s[used])
    grid = [(1.0, 1.0)]
    if law.stribeck != "none":
        speeds = np.geomspace(size.min(), size.max(), SPEEDS)
        grid = [(float(v), shape) for v in speeds for shape in SHAPES]
    best, sums, errors = None, [], []
    for stribeck, shape in grid:
        X = law.columns(p, stribeck, shape)[used] * weight[:, None]
        scale = np.linalg.norm(X, axis=0)
        scale[scale == 0.0] = 1.0
        U, d, _ = np.linalg.svd(X / scale, full_matrices=False)
        U = U[:, d > 1e-9 * d[0]]
        left = y - U @ (U.T @ y)
        free = np.maximum(1.0 - np.sum(U**2, axis=1), 1e-6)
        errors.append(left / free)
        sums.append(left @ left - left**2 / free)
        total = float(left @ left)
        if best is None or total < best[0]:
            best = (total, stribeck, shape)
    chosen = np.argmin(sums, axis=0)
    one_out = np.array(errors)[chosen, np.arange(used.size)]
    inner = (size > size.min()) & (size < size.max())
    _, stribeck, shape = best
    X = law.columns(p, stribeck, shape)
    Xw = X[used] * weight[:, None]
    scale = np.linalg.norm(Xw, axis=0)
    scale[scale == 0.0] = 1.0
    inverse = np.linalg.pinv(Xw / scale, rcond=1e-9) / scale[:, None]
    values = inverse @ y
    left = p.torque_Nm - p.load_Nm - X @ values
    # errors that a law leaves beyond the points' own widen what is said of its values
    spread = max(best[0] / max(used.size - values.size, 1), 1.0)
    covariance = spread * inverse @ inverse.T
    return MapFit(
        law=law,
        values=dict(zip(law.names, map(float, values), strict=True)),
        std=dict(zip(law.names, map(float, np.sqrt(np.diag(covariance))), strict=True)),
        covariance=covariance,
        stribeck_rad_per_s=stribeck,
        shape=shape,
        left_Nm=left,
        score=float(np.sqrt(np.mean(one_out[inner] ** 2))),
    )


def compare_laws(p: SteadyPoints) -> list[MapFit]:
    """Every law's fit, best first."""
    return sorted((fit_law(p, law) for law in candidate_laws(p)), key=lambda fit: fit.score)


def rms(values: Sequence[float] | NDArray) -> float:
    """Root mean square; 0 of nothing."""
    array = np.asarray(values, dtype=float)
    return float(np.sqrt(np.mean(array**2))) if array.size else 0.0
