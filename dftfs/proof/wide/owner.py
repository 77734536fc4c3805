"""What the owner believes: a rig file whose values are off by no more than it states."""

from dataclasses import dataclass, field, replace

import numpy as np

from dftfs.proof.wide.machines import GRAVITY, Drawn
from dftfs.proof.wide.refit import FREE, NUISANCES, Fit
from dftfs.proof.wide.truth.body import BY_VOLTAGE, Body

RIG_KEYS: dict[str, str] = {
    "supply": "supply_voltage_V",
    "resistance": "terminal_resistance_ohm",
    "inductance": "terminal_inductance_H",
    "torque_constant": "torque_constant_Nm_per_A",
    "emf_constant": "back_emf_constant_Vs_per_rad",
    "current_limit": "current_limit_A",
    "motor_inertia": "motor_inertia_kgm2",
    "motor_viscous": "motor_viscous_Nms_per_rad",
    "gear_ratio": "gear_ratio",
    "output_inertia": "output_inertia_kgm2",
    "output_viscous": "output_viscous_Nms_per_rad",
    "stiffness": "spring_stiffness_Nm_per_rad",
    "load_inertia": "load_inertia_kgm2",
    "load_viscous": "load_viscous_Nms_per_rad",
    "gravity": "load_mass_kg",
}
EXACT = ("gear_ratio", "current_limit")
FARTHEST = 1.8  # deviations: the truth lies inside what the file states
USUAL = 0.03  # larger deviations are always stated


@dataclass(frozen=True, kw_only=True)
class Owner:
    """Relative error of each value (nominal over true), its stated deviation, absent values.

    ``scales``: a plausible size of each absent viscous value.
    """

    errors: dict[str, float]
    deviations: dict[str, float]
    absent: tuple[str, ...]
    stated: bool
    magnitudes: dict[str, float] = field(default_factory=dict)
    gravity_offset: float = 0.0

    def body(self, true: Body) -> Body:
        """The machine of the rig file."""
        values = {n: four_digits(getattr(true, n) * e) for n, e in self.errors.items()}
        values |= dict.fromkeys(self.absent, 0.0)
        return true._replace(**values, gravity_offset=0.0)

    def prior(self, fit: Fit) -> np.ndarray:
        """Tolerance of each constant of a fit in its steps."""
        out = []
        for name in fit.names:
            if name in self.absent:
                out.append(2.0)
            elif name in NUISANCES or name == "gravity_offset":
                out.append(1.0)
            else:
                out.append(max(self.deviations.get(name, 0.02), 0.01) / FREE[name])
        return np.array(out)

    def fooled(
        self, jacobian: np.ndarray, total: np.ndarray, fit: Fit, rng: np.random.Generator
    ) -> "Owner":
        """The owner who calibrated one constant on the faulty machine: it takes some blame."""
        best, which = 0.0, None
        for j, name in enumerate(fit.names):
            if name not in self.errors or name in EXACT:
                continue
            column = jacobian[:, j]
            along = float(column @ total) / max(float(np.linalg.norm(column)), 1e-12)
            if abs(along) > abs(best):
                best, which = along, j
        if which is None:
            return self
        column, name = jacobian[:, which], fit.names[which]
        shift = float(column @ total) / float(column @ column) * rng.uniform(0.5, 1.0)
        factor = float(np.exp(np.clip(FREE[name] * shift, -0.25, 0.25)))
        wide = max(self.deviations[name], abs(np.log(factor)) / 1.2)
        errors = self.errors | {name: self.errors[name] * factor}
        return replace(self, errors=errors, deviations=self.deviations | {name: wide})

    def tolerances(self) -> dict[str, float]:
        """The [tolerances] of the rig file."""
        return {
            RIG_KEYS[n]: float(f"{d:.2g}")
            for n, d in self.deviations.items()
            if n not in self.absent and (self.stated or d > USUAL)
        }

    def table(self, true: Body, m: Drawn) -> dict[str, list]:
        """Rig file and truth of every value, by the rig file's key; None where it is absent."""
        out: dict[str, list] = {}
        for n, error in self.errors.items():
            unit = GRAVITY * m.distance if n == "gravity" else 1.0
            value = getattr(true, n) / unit
            out[RIG_KEYS[n]] = [None if n in self.absent else four_digits(value * error), value]
        return out


def four_digits(value: float) -> float:
    return float(f"{value:.4g}")


def draw_owner(rng: np.random.Generator, m: Drawn) -> Owner:
    """Values off by 1 to 3 %, viscous ones by 35 % or absent, at times one by up to a third."""
    names = [
        n for n in RIG_KEYS if getattr(m.body, n) > 0.0 and n not in ("supply", "current_limit")
    ]
    if m.command == "duty":
        names.append("supply")
    if m.body.drive != BY_VOLTAGE:
        names = [n for n in names if n not in ("resistance", "inductance", "emf_constant")]
    if m.command is None:
        names = [n for n in names if n.startswith(("load", "gravity"))]
    if m.command is not None:
        names.append("current_limit")
    deviations = {}
    for n in names:
        viscous = n.endswith("viscous")
        deviations[n] = 0.35 if viscous else float(rng.uniform(0.005, 0.03))
    movable = [n for n in names if n not in EXACT and not n.endswith("viscous")]
    if rng.random() < 0.3:
        deviations[str(rng.choice(movable))] = float(rng.uniform(0.08, 0.18))
    for n in EXACT:
        deviations.pop(n, None)
    errors = dict.fromkeys(names, 1.0)
    for n, d in deviations.items():
        errors[n] = 1.0 / (1.0 + d * float(np.clip(rng.normal(), -FARTHEST, FARTHEST)))
    absent = tuple(n for n in names if n.endswith("viscous") and rng.random() < 0.25)
    absent += tuple(n for n in names if n == "inductance" and rng.random() < 0.3)
    magnitudes = {n: getattr(m.body, n) for n in absent if n.endswith("viscous")}
    return Owner(errors=errors, deviations=deviations, absent=absent,
                 stated=bool(rng.random() < 0.5), magnitudes=magnitudes)  # fmt: skip
