"""Parameters only: how much of a trace other values of the rig's constants can mimic.

`Trace` linearises at the truth (weighted least squares on the readings' differences) and says how
strong an effect is: the part of its trace that no constants mimic, in units of the noise floor.
`refit` estimates the constants from the readings themselves, by Levenberg-Marquardt.
"""

from dataclasses import dataclass, replace

import numpy as np

from dftfs.proof.bench import Session, motions
from dftfs.proof.machine import Machine
from dftfs.proof.readings import expected

COARSE_STEP_S = 500e-6
DECIMATION = 4
CORRELATED_SAMPLES = 25.0
ITERATIONS, ENOUGH = 12, 3e-3  # the descent ends where a step gains less than this share

# Standard deviation that the refit allows each constant; relative, the two angles in rad.
FREE: dict[str, float] = {
    "supply_voltage_V": 0.02,
    "terminal_resistance_ohm": 0.1,
    "terminal_inductance_H": 0.2,
    "torque_constant_Nm_per_A": 0.1,
    "back_emf_constant_Vs_per_rad": 0.1,
    "motor_inertia_kgm2": 0.15,
    "motor_viscous_Nms_per_rad": 0.6,
    "output_inertia_kgm2": 0.2,
    "output_viscous_Nms_per_rad": 0.6,
    "spring_stiffness_Nm_per_rad": 0.15,
    "load_mass_kg": 0.03,
    "load_inertia_kgm2": 0.12,
    "load_viscous_Nms_per_rad": 0.8,
    "gravity_angle_offset_rad": 0.005,
}
FREE_CONTACT: dict[str, float] = {
    "contact_stiffness_Nm_per_rad": 0.3,
    "contact_angle_rad": 0.01,
    "contact_damping_Nms_per_rad": 0.8,
}
IN_RAD = ("gravity_angle_offset_rad", "contact_angle_rad")


def free_constants(session: Session) -> dict[str, float]:
    touches = any(p.load == "contact" for p in session.planned)
    return FREE | FREE_CONTACT if touches else dict(FREE)


def moved(machine: Machine, free: dict[str, float], shift: np.ndarray) -> Machine:
    """The machine with its free constants moved by ``shift`` standard deviations."""
    values = {}
    for (name, spread), s in zip(free.items(), shift, strict=True):
        old = getattr(machine, name)
        values[name] = old + spread * s if name in IN_RAD else old * np.exp(spread * s)
    return machine._replace(**{k: float(v) for k, v in values.items()})


def floors(session: Session, rng: np.random.Generator) -> list[dict[str, float]]:
    """Noise floor per recording and column: the sensor's noise and the bridge's own wandering."""
    quiet = motions(session, step_s=COARSE_STEP_S)
    shaken = motions(session, step_s=COARSE_STEP_S, noise=rng)
    out = []
    for planned, a, b in zip(session.planned, quiet, shaken, strict=True):
        clean = expected(a.values, planned.time_s, session.sensors)
        other = expected(b.values, planned.time_s, session.sensors)
        out.append(
            {
                c: float(np.hypot(session.sensors.noise(c), (other[c] - clean[c]).std()))
                for c in clean
                if c != "temperature_C" and not _dead(planned.load, c)
            }
        )
    return out


def _dead(load: str, column: str) -> bool:
    return load == "locked" and column == "load_angle_rad"


def stack(
    session: Session, values: list[dict[str, np.ndarray]], floor: list[dict[str, float]]
) -> np.ndarray:
    """Readings over floor, every fourth sample, all recordings and columns in one vector."""
    parts = [
        v[c][::DECIMATION] / f[c] for v, f in zip(values, floor, strict=True) for c in f if c in v
    ]
    return np.concatenate(parts)


def simulated(session: Session, step_s: float = COARSE_STEP_S) -> list[dict[str, np.ndarray]]:
    """Readings without noise of a session."""
    sensors = session.sensors
    faults: dict = {}
    for one in session.applied:
        faults |= one.faults
    sensors = replace(sensors, faults=faults)
    return [
        expected(m.values, p.time_s, sensors)
        for p, m in zip(session.planned, motions(session, step_s=step_s), strict=True)
    ]


def sensitivity(
    session: Session, free: dict[str, float], floor: list[dict[str, float]], base: np.ndarray
) -> np.ndarray:
    """Forward differences of the stacked readings by the shifts. Shape (readings, constants)."""
    columns = []
    step = 0.02
    for j in range(len(free)):
        shift = np.zeros(len(free))
        shift[j] = step
        other = replace(session, machine=moved(session.machine, free, shift))
        columns.append((stack(session, simulated(other), floor) - base) / step)
    return np.column_stack(columns)


@dataclass(frozen=True, kw_only=True)
class Trace:
    """The linearised session without effects: ready to weigh the trace of any effect."""

    session: Session
    floor: list[dict[str, float]]
    base: np.ndarray
    jacobian: np.ndarray

    @staticmethod
    def of(session: Session, rng: np.random.Generator) -> "Trace":
        bare = replace(session, applied=())
        floor = floors(bare, rng)
        base = stack(bare, simulated(bare), floor)
        free = free_constants(bare)
        return Trace(
            session=bare,
            floor=floor,
            base=base,
            jacobian=sensitivity(bare, free, floor, base),
        )

    def difference(self, session: Session, step_s: float = 50e-6) -> np.ndarray:
        """What the effects of ``session`` change in the readings, over the floor."""
        return stack(session, simulated(session, step_s), self.floor) - self.base

    def left_over(
        self,
        difference: np.ndarray,
        also: np.ndarray | None = None,
        pinned: tuple[str, ...] = (),
    ) -> np.ndarray:
        """What the constants but the pinned ones (and the columns ``also``) cannot mimic."""
        names = list(free_constants(self.session))
        matrix = self.jacobian[:, [j for j, n in enumerate(names) if n not in pinned]]
        prior = np.eye(matrix.shape[1])
        if also is not None:
            matrix = np.column_stack([matrix, also])
            prior = np.pad(prior, ((0, also.shape[1]), (0, also.shape[1])))
        normal = matrix.T @ matrix + prior
        return difference - matrix @ np.linalg.lstsq(normal, matrix.T @ difference, rcond=None)[0]

    def strength(self, left: np.ndarray) -> float:
        """Largest root mean square over recordings and columns, in units of the floor."""
        top, start = 0.0, 0
        for planned, floor in zip(self.session.planned, self.floor, strict=True):
            size = planned.time_s[::DECIMATION].size
            for _ in floor:
                top = max(top, float(np.sqrt(np.mean(left[start : start + size] ** 2))))
                start += size
        return top


def refit(
    session: Session, readings: list[dict[str, np.ndarray]], floor: list[dict[str, float]]
) -> Machine:
    """The constants that fit the readings best without any effect, from the nominal ones.

    ``session.machine`` is the nominal machine; effects and faults must be absent. Recordings with
    a clamped output are fitted first: a stiffness that is off moves the resonance of a swinging
    link, and its damping then hides the mistake in a local minimum.
    """
    shift = np.zeros(len(free_constants(session)))
    clamped = [k for k, p in enumerate(session.planned) if p.load == "locked"]
    for chosen in (clamped, list(range(len(session.planned)))):
        if chosen:
            part = replace(session, planned=tuple(session.planned[k] for k in chosen))
            shift = _descend(
                part,
                free_constants(session),
                [readings[k] for k in chosen],
                [floor[k] for k in chosen],
                shift,
            )
    return moved(session.machine, free_constants(session), shift)


def _descend(
    session: Session,
    free: dict[str, float],
    readings: list[dict[str, np.ndarray]],
    floor: list[dict[str, float]],
    shift: np.ndarray,
) -> np.ndarray:
    """Levenberg-Marquardt in tolerances from a shift, bounded by four of them.

    The tolerances weigh as much as a few correlation times of the misfit, so that directions
    without information stay where they are.
    """
    target = stack(session, readings, floor)

    def left_at(s: np.ndarray) -> np.ndarray:
        trial = replace(session, machine=moved(session.machine, free, s))
        return target - stack(session, simulated(trial), floor)

    left, damping = left_at(shift), 1e-3
    for _ in range(ITERATIONS):
        prior = CORRELATED_SAMPLES * max(1.0, float(np.mean(left**2)))
        cost = float(left @ left + prior * shift @ shift)
        here = replace(session, machine=moved(session.machine, free, shift))
        jacobian = sensitivity(here, free, floor, target - left)
        normal = jacobian.T @ jacobian + prior * np.eye(len(free))
        slope = jacobian.T @ left - prior * shift
        for _ in range(6):
            step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), slope)
            trial = np.clip(shift + step, -4.0, 4.0)
            rest = left_at(trial)
            new = float(rest @ rest + prior * trial @ trial)
            if new < cost:
                damping = max(1e-6, damping / 10.0)
                break
            damping *= 10.0
        else:
            break
        shift, left = trial, rest
        if cost - new < ENOUGH * cost:
            break
    return shift
