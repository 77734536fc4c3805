"""Hypotheses of what the columns of a log are, their scores, and the posterior of each column."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RecordingError
from rsea_core.importing.motion_evidence import motion_laws
from rsea_core.importing.streams.column_names import NameEvidence
from rsea_core.importing.unit_evidence import (
    FOLLOWS,
    Law,
    correlation_of,
    current_laws,
    derivative_laws,
    gear_laws,
    sensor_laws,
    servo_laws,
    spring_laws,
    winding_laws,
)
from rsea_core.machine.inputs import POSITION_COMMAND
from rsea_core.machine.rig import Rig, is_linear
from rsea_core.recordings.column_map import counts_of
from rsea_core.recordings.units import factor_and_offset, unit_of_column
from rsea_core.terms.known import KnownTerm

UNITS: Mapping[str, tuple[tuple[str, float], ...]] = {
    "time": (("s", 0.0), ("ms", -0.3), ("us", -0.6), ("ns", -0.6)),
    "angle": (("rad", 0.0), ("deg", -0.3), ("turn", -2.0), ("count", -1.0)),
    "deflection": (("rad", 0.0), ("deg", -0.3)),
    "velocity": (("rad/s", 0.0), ("deg/s", -0.7), ("rpm", -0.7), ("turn/s", -2.0)),
    "current": (("A", 0.0), ("mA", -0.7)),
    "torque": (("N*m", 0.0), ("mN*m", -1.0), ("N*cm", -3.0)),
    "duty": (("dimensionless", 0.0), ("percent", -0.5), ("permille", -4.0)),
    "voltage": (("V", 0.0), ("mV", -1.0)),
    "supply": (("V", 0.0), ("mV", -1.0)),
    "temperature": (("degC", 0.0),),
    "enabled": (("dimensionless", 0.0),),
}
"""Units of each quantity with the logarithm of how usual they are."""
LINEAR: Mapping[str, tuple[tuple[str, float], ...]] = {
    "angle": (("m", 0.0), ("mm", -0.3), ("um", -1.5)),
    "deflection": (("m", 0.0), ("mm", -0.3)),
    "velocity": (("m/s", 0.0), ("mm/s", -0.7)),
    "torque": (("N", 0.0), ("kN", -3.0)),
}
"""The same of a linear axis, for columns that are not the motor's."""
STATED = -15.0  # a unit other than the one that a name or a file states
OTHER_SIDE = -2.0  # an angle that was measured on the other side of the gear than it is named for
ODD, IMPOSSIBLE = -4.0, -25.0
MOST_ROWS = 6000
LIKELY_STEP_s, POSSIBLE_STEP_s = (9e-5, 0.11), (5e-6, 0.4)
COUNTS = (4096.0, 8192.0, 2000.0, 1024.0, 16384.0)


@dataclass(frozen=True)
class Choice:
    """One reading of one column: target, unit, side of the gear, with its factor to SI."""

    name: str
    target: str
    unit: str
    side: str | None
    counts_per_rev: float | None
    factor: float
    prior: float


@dataclass(frozen=True, kw_only=True)
class Posterior:
    """The best hypothesis and how sure each of its choices is.

    Attributes
    ----------
    choices : tuple of Choice
    confidence : mapping of column name to probability
    rivals : mapping of column name to the second best choice, where there is one
    laws : tuple of Law
        What the best hypothesis was held against.
    """

    choices: tuple[Choice, ...]
    confidence: Mapping[str, float]
    rivals: Mapping[str, Choice]
    laws: tuple[Law, ...]

    def without(self, made: set[str]) -> "Posterior":
        """Less the laws that tie readings to columns that the logger computed."""
        return replace(self, laws=tuple(x for x in self.laws if made.isdisjoint(x.columns)))


def choices_of(name: str, target: str, evidence: NameEvidence, raw: NDArray, rig: Rig | None):
    """Every unit and side that a column of a target may have."""
    quantity = quantity_of(target)
    linear = is_linear(rig)
    options = list(UNITS[quantity])
    if linear and not (target.startswith("motor") and (rig.gear_ratio or 1.0) != 1.0):
        options = list(LINEAR.get(quantity, options))
        if quantity == "angle" and counts_of(rig, target, None):
            options.append(("count", -1.0))
    known = {unit for unit, _ in options}
    stated = evidence.unit
    if stated is not None and stated not in known:
        options.append((stated, 0.0))
    whole = bool(np.all(raw[: 20 * MOST_ROWS] == np.round(raw[: 20 * MOST_ROWS])))
    found = []
    for unit, prior in options:
        if stated is not None:
            prior = 0.0 if _same(unit, stated, target, linear) else STATED
        elif unit == "count":
            prior = 0.5 if whole and np.ptp(raw) > 20.0 else -12.0
        elif quantity == "angle" and whole and np.ptp(raw) > 100.0:
            prior -= 3.0
        elif quantity == "velocity" and (whole or evidence.is_rate_of_turns):
            prior = 0.5 if unit == "rpm" else prior - 0.5
        found += _sided(name, target, unit, prior, rig, raw)
    return [c for c in found if c.prior > IMPOSSIBLE] or found


def quantity_of(target: str) -> str:
    """The quantity of a column of the contract."""
    if target == POSITION_COMMAND:
        return "angle"
    for key in ("time", "velocity", "deflection", "angle", "torque", "temperature", "duty",
                "supply", "enabled", "voltage", "current"):  # fmt: skip
        if key in target:
            return key
    raise ValueError(target)


def _same(unit: str, stated: str, target: str, linear: bool) -> bool:
    try:
        own = factor_and_offset(unit, unit_of_column(target), 1.0, linear=linear)
        other = factor_and_offset(stated, unit_of_column(target), 1.0, linear=linear)
    except Exception:  # a unit that is none: never the stated one
        return unit == stated
    return bool(np.isclose(own[0], other[0], rtol=1e-9))


def _sided(name, target, unit, prior, rig: Rig | None, raw) -> list[Choice]:
    ratio = None if rig is None else rig.gear_ratio
    sides = [None]
    if target.endswith("angle_rad") and ratio and ratio > 1.5:
        sides.append("load" if target.startswith("motor") else "motor")
    found = []
    for side in sides:
        for counts in _counts(target, side, rig) if unit == "count" else (None,):
            try:
                factor, _ = factor_and_offset(
                    unit, unit_of_column(target), counts, linear=is_linear(rig)
                )
            except Exception:  # a stated unit that does not fit this target
                continue
            if side is not None:
                factor *= ratio if side == "load" else 1.0 / ratio
            own = prior + (0.0 if side is None else OTHER_SIDE)
            odds = _range_prior(target, factor, raw, rig)
            if target == "time_s" and prior == 0.0 and unit != "s":
                odds = max(odds, 2.0 * ODD)  # a stated clock may be an index of a map
            own += odds
            found.append(Choice(name, target, unit, side, counts, factor, own))
    return found


def _counts(target: str, side: str | None, rig: Rig | None) -> Sequence[float]:
    known = None if rig is None else counts_of(rig, target, side)
    return (known,) if known else COUNTS[:2]


def _range_prior(target: str, factor: float, raw: NDArray, rig: Rig | None) -> float:
    top = abs(factor) * float(np.abs(raw).max())
    span = abs(factor) * float(np.ptp(raw))
    if target == "time_s":
        step = factor * float(np.median(np.diff(raw)))
        if not POSSIBLE_STEP_s[0] < step < POSSIBLE_STEP_s[1]:
            return IMPOSSIBLE
        odd = not LIKELY_STEP_s[0] < step < LIKELY_STEP_s[1]
        return (ODD if odd else 0.0) + (ODD if span < 0.2 or span > 7200.0 else 0.0)
    if target == "duty":
        if top > 1.0 + 1e-6:
            return IMPOSSIBLE
        return -1.5 if top < 0.02 else 0.0
    if rig is None:
        return ODD if target == "load_angle_rad" and span > 200.0 else 0.0
    limit = rig.current_limit_A
    if target in ("current_A", "current_command_A") and limit:
        return IMPOSSIBLE if top > 3.0 * limit else ODD if top < 2e-3 * limit else 0.0
    if target in ("voltage_V", "supply_V") and rig.supply_voltage_V:
        share = top / rig.supply_voltage_V
        return IMPOSSIBLE if share > 3.0 else ODD if share < 2e-3 else 0.0
    if target == "torque_Nm" and limit and rig.torque_constant_Nm_per_A:
        most = limit * rig.torque_constant_Nm_per_A * (rig.gear_ratio or 1.0)
        return ODD * 3 if top > 5.0 * most else ODD if top < 1e-5 * most else 0.0
    if target == "load_angle_rad":
        return ODD if span > 200.0 else -1.0 if span < 2e-3 else 0.0
    return 0.0


def best_hypothesis(
    rig: Rig | None,
    raw: Mapping[str, NDArray],
    assignments: Sequence[Mapping[str, list[Choice]]],
    terms: Sequence[KnownTerm] = (),
) -> Posterior:
    """The most probable choices of all columns together.

    Parameters
    ----------
    raw : mapping of column name to (n,) array
        As logged.
    assignments : sequence of mapping of column name to its choices
        Alternative meanings of the columns, each with the choices of unit and side.
    terms : sequence of KnownTerm
        Friction and springs that the rig file states.

    Raises
    ------
    RecordingError
        If there is no meaning.
    """
    if not assignments:
        raise RecordingError("the units that the log states fit no reading that its names are of")
    reader = _Laws(rig, raw, terms)
    found: list[tuple[float, tuple[Choice, ...]]] = []
    for assignment in assignments:
        names = list(assignment)
        free = [assignment[n] for n in names]
        # the columns that no law ties are judged by their own evidence alone
        for combination in itertools.product(*_pruned(free)):
            score = sum(c.prior for c in combination) + reader.score(combination)
            found.append((score, combination))
    found.sort(key=lambda item: -item[0])
    top, best = found[0]
    weights = np.array([np.exp(min(0.0, max(s - top, -700.0))) for s, _ in found])
    weights /= weights.sum()
    confidence, rivals = {}, {}
    for choice in best:
        same = [_key(choice) in {_key(c) for c in others} for _, others in found]
        confidence[choice.name] = float(np.sum(weights[np.array(same)]))
        rival = next((c for (_, others), ok in zip(found, same) if not ok
                      for c in others if c.name == choice.name), None)  # fmt: skip
        if rival is not None:
            rivals[choice.name] = rival
    laws = tuple(reader.of(best))
    return Posterior(choices=best, confidence=confidence, rivals=rivals, laws=laws)


def _key(c: Choice) -> tuple:
    return c.name, c.target, round(np.log(abs(c.factor)), 6)


def _pruned(free: list[list[Choice]]) -> list[list[Choice]]:
    """Choices that are not excluded by themselves, at most a few thousand combinations."""
    kept = []
    for options in free:
        top = max(c.prior for c in options)
        kept.append([c for c in options if c.prior > top - 20.0])
    while np.prod([len(k) for k in kept]) > 6000:
        longest = max(range(len(kept)), key=lambda k: len(kept[k]))
        kept[longest] = sorted(kept[longest], key=lambda c: -c.prior)[: len(kept[longest]) - 1]
    return kept


class _Laws:
    """Scores of laws, each computed once for the choices that it depends on."""

    def __init__(
        self, rig: Rig | None, raw: Mapping[str, NDArray], terms: Sequence[KnownTerm] = ()
    ):
        self.rig = rig
        self.ratio = 1.0 if rig is None else rig.gear_ratio or 1.0
        rows = max(v.size for v in raw.values())
        self.stride = max(1, rows // MOST_ROWS)
        self.raw = {name: np.asarray(v, dtype=float) for name, v in raw.items()}
        self.short = {name: v[:: self.stride] for name, v in self.raw.items()}
        self.found: dict[tuple, list[Law]] = {}
        rig_laws = [] if rig is None else [
            (winding_laws, ("time_s", "duty", "voltage_V", "current_A", "motor_angle_rad",
                            "motor_velocity_rad_per_s", "load_angle_rad",
                            "load_velocity_rad_per_s")),
            (partial(motion_laws, terms=terms),
             ("time_s", "current_command_A", "duty", "voltage_V", "current_A", "motor_angle_rad",
              "load_angle_rad")),
            (spring_laws, ("time_s", "motor_angle_rad", "load_angle_rad", "torque_Nm",
                           "spring_deflection_rad")),
        ]  # fmt: skip
        self.groups = [
            (derivative_laws, ("time_s", "motor_angle_rad", "motor_velocity_rad_per_s")),
            (derivative_laws, ("time_s", "load_angle_rad", "load_velocity_rad_per_s")),
            (gear_laws, ("time_s", "motor_angle_rad", "load_angle_rad")),
            (current_laws, ("time_s", "current_command_A", "current_A")),
            (servo_laws, ("time_s", POSITION_COMMAND, "motor_angle_rad", "load_angle_rad")),
            *rig_laws,
        ]

    def score(self, choices: Sequence[Choice]) -> float:
        return sum(law.size_score() for law in self.of(choices))

    def _best_of(self, function, columns: dict[str, NDArray]) -> list[Law]:
        """The law; where angles are subtracted, with the sign of the load's that fits better."""
        found = function(self.rig, columns, self.ratio)
        if function is not spring_laws or "load_angle_rad" not in columns:
            return found
        turned = {**columns, "load_angle_rad": -columns["load_angle_rad"]}
        other = function(self.rig, turned, self.ratio)
        if not found or not other:
            return found or other
        motor = columns.get("motor_angle_rad", columns["load_angle_rad"])
        together = correlation_of(motor, columns["load_angle_rad"])
        if abs(together) > FOLLOWS:
            return found if together > 0.0 else other
        return max(found, other, key=lambda laws: sum(law.size_score() for law in laws))

    def of(self, choices: Sequence[Choice]) -> list[Law]:
        by_target = {c.target: c for c in choices}
        laws = []
        for k, (function, targets) in enumerate(self.groups):
            own = tuple(by_target[t] for t in targets if t in by_target)
            key = (k, *((c.target, c.name, c.factor) for c in own))
            if key not in self.found:
                columns = {c.target: c.factor * self.short[c.name] for c in own}
                self.found[key] = self._best_of(function, columns)
            laws += self.found[key]
        if self.rig is not None:
            for c in choices:
                key = ("sensor", c.target, c.name, c.factor)
                if key not in self.found:
                    one = {c.target: self.raw[c.name]}
                    self.found[key] = sensor_laws(self.rig, one, self.ratio, scale=c.factor)
                laws += self.found[key]
        return laws
