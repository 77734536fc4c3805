"""Parameters only: what other constants, an offset and a late command leave of a difference."""

from dataclasses import dataclass, replace

import numpy as np

from dftfs.proof.wide.truth.simulate import Session, UnstableError, readings

ROWS = 1200  # of a recording are looked at, at most
ITERATIONS, ENOUGH = 8, 3e-3
PRIOR_ROWS = 10.0  # a constant's tolerance weighs as much as so many rows of the misfit
# relative freedom of each constant; the offset of gravity in rad
FREE: dict[str, float] = {
    "supply": 0.02,
    "resistance": 0.1,
    "inductance": 0.2,
    "torque_constant": 0.05,
    "emf_constant": 0.05,
    "motor_inertia": 0.1,
    "motor_viscous": 0.6,
    "output_inertia": 0.1,
    "output_viscous": 0.6,
    "stiffness": 0.1,
    "load_inertia": 0.1,
    "load_viscous": 0.6,
    "gravity": 0.05,
    "gravity_offset": 0.02,
}
NUISANCES = ("offset", "delay", "speed")


@dataclass(frozen=True, kw_only=True)
class Fit:
    """Which constants move, and the sizes of their steps.

    ``scales``: a step of a constant whose rig value is absent (0), by name.
    """

    names: tuple[str, ...]
    full: float
    row_s: float
    magnitudes: dict[str, float]

    @staticmethod
    def of(session: Session, command: str | None, magnitudes: dict[str, float]) -> "Fit":
        b = session.body
        names = [
            n for n in FREE if (n != "gravity_offset" and getattr(b, n) > 0.0) or n in magnitudes
        ]
        if command != "duty":
            names = [n for n in names if n != "supply"]
        if b.drive != 2:
            names = [n for n in names if n not in ("resistance", "inductance", "emf_constant")]
        if b.gravity > 0.0:
            names.append("gravity_offset")
        full = 0.0
        if command is not None:
            names += ["offset", "delay"]
            full = max(float(np.abs(p.command).max()) for p in session.planned)
        if any(p.start.speed for p in session.planned):
            names.append("speed")
        row = float(np.median(np.diff(session.planned[0].rows_s)))
        return Fit(names=tuple(dict.fromkeys(names)), full=full, row_s=row, magnitudes=magnitudes)

    def moved(self, session: Session, shift: np.ndarray) -> Session:
        """The session with its constants moved by ``shift`` steps."""
        changes, planned = {}, session.planned
        for name, s in zip(self.names, shift, strict=True):
            if name == "offset":
                planned = tuple(replace(p, offset=p.offset + 0.01 * self.full * s) for p in planned)
            elif name == "delay":
                late = self.row_s * s
                planned = tuple(replace(p, delay_s=p.delay_s + late) for p in planned)
            elif name == "speed":
                planned = tuple(
                    replace(p, start=p.start._replace(speed=p.start.speed * np.exp(0.1 * s)))
                    for p in planned
                )
            elif name == "gravity_offset":
                changes[name] = session.body.gravity_offset + FREE[name] * s
            else:
                old = getattr(session.body, name)
                changes[name] = (
                    old * np.exp(FREE[name] * s)
                    if old > 0.0
                    else self.magnitudes[name] * max(s, 0.0)
                )
        return replace(session, body=session.body._replace(**changes), planned=planned)


def stacked(values: list[dict], floor: list[dict]) -> np.ndarray:
    """Readings over their floor in one vector, decimated."""
    parts = []
    for v, f in zip(values, floor, strict=True):
        for c in f:
            every = max(1, v[c].size // ROWS)
            parts.append(v[c][::every] / f[c])
    return np.concatenate(parts)


def blocks(values: list[dict], floor: list[dict]) -> list[tuple[int, int, str]]:
    """Start and end in the stacked vector of each recording and column."""
    out, start = [], 0
    for v, f in zip(values, floor, strict=True):
        for c in f:
            size = -(-v[c].size // max(1, v[c].size // ROWS))
            out.append((start, start + size, c))
            start += size
    return out


@dataclass(frozen=True, kw_only=True)
class Trace:
    """A session without effects, linearised in its constants."""

    session: Session
    floor: list[dict]
    base: np.ndarray
    jacobian: np.ndarray
    blocks: list[tuple[int, int, str]]
    fit: Fit

    @staticmethod
    def of(session: Session, floor: list[dict], fit: Fit) -> "Trace":
        values = readings(session)
        base = stacked(values, floor)
        return Trace(session=session, floor=floor, base=base, fit=fit,
                     jacobian=sensitivity(session, fit, floor, base),
                     blocks=blocks(values, floor))  # fmt: skip

    def left_over(self, difference: np.ndarray, also: np.ndarray | None = None) -> np.ndarray:
        """What the constants, and the columns ``also``, cannot mimic of a difference."""
        matrix = self.jacobian
        prior = np.eye(matrix.shape[1])
        if also is not None:
            matrix = np.column_stack([matrix, also])
            prior = np.pad(prior, ((0, also.shape[1]), (0, also.shape[1])))
        normal = matrix.T @ matrix + prior
        return difference - matrix @ np.linalg.lstsq(normal, matrix.T @ difference, rcond=None)[0]

    def strength(self, left: np.ndarray) -> float:
        """Largest rms over recordings and columns, in noise floors."""
        return max(float(np.sqrt(np.mean(left[a:b] ** 2))) for a, b, _ in self.blocks)


def sensitivity(
    session: Session, fit: Fit, floor: list[dict], base: np.ndarray, at: np.ndarray | None = None
) -> np.ndarray:
    """Forward differences of the stacked readings by the shifts. (readings, constants)"""
    columns, step = [], 0.02
    for j in range(len(fit.names)):
        shift = np.zeros(len(fit.names)) if at is None else at.copy()
        shift[j] += step
        columns.append((stacked(readings(fit.moved(session, shift)), floor) - base) / step)
    return np.column_stack(columns)


def refit(
    session: Session, logged: list[dict], floor: list[dict], fit: Fit, prior: np.ndarray
) -> tuple[np.ndarray, float]:
    """Shifts of the constants that fit best without any effect, and the largest rms left.

    ``prior``: tolerance of each constant in steps. Levenberg-Marquardt.
    """
    target, shift, damping = stacked(logged, floor), np.zeros(len(fit.names)), 1e-3

    def rest_at(s: np.ndarray) -> np.ndarray:
        try:
            return np.nan_to_num(target - stacked(readings(fit.moved(session, s)), floor), nan=1e6)
        except UnstableError:
            return np.full(target.size, 1e6)

    rest = rest_at(shift)
    for _ in range(ITERATIONS):
        weight = PRIOR_ROWS * max(1.0, float(np.mean(rest**2))) / prior**2
        cost = float(rest @ rest + weight @ shift**2)
        jacobian = sensitivity(session, fit, floor, target - rest, shift)
        normal = jacobian.T @ jacobian + np.diag(weight)
        slope = jacobian.T @ rest - weight * shift
        for _ in range(6):
            step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), slope)
            trial = np.clip(shift + step, -8.0, 8.0)
            new_rest = rest_at(trial)
            new = float(new_rest @ new_rest + weight @ trial**2)
            if new < cost:
                damping = max(1e-6, damping / 10.0)
                break
            damping *= 10.0
        else:
            break
        shift, rest = trial, new_rest
        if cost - new < ENOUGH * cost:
            break
    where = blocks(logged, floor)
    return shift, max(float(np.sqrt(np.mean(rest[a:b] ** 2))) for a, b, _ in where)
