"""What no known effect explains, as a signal: where it enters, how large, on what it depends.

A mismatch without a law still has a place. The port whose unknown signal makes the readings most
likely, with the rig's values at their best jointly with it (`unknown_input`), says where to look;
the signal itself, smoothed, and the states at which it is large or changes say when.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp
from rsea_core.effects.gear_backlash import GearBacklash
from rsea_core.effects.gear_transmission_error import GearTransmissionError
from rsea_core.identify.fitting.least_squares import Fit
from rsea_core.identify.fitting.problem import PreparedRecording, machine_of
from rsea_core.identify.judgement.criteria import IN_CONTACT, OWN_PACE_s
from rsea_core.identify.judgement.residual_fit import TableFit, table_fit
from rsea_core.identify.locate.mismatch_map import (
    BLOCK_s,
    Concentration,
    concentrations,
    since_reversal,
)
from rsea_core.identify.locate.unknown_input import (
    JointFit,
    RankedPort,
    fit_jointly,
    ranked_ports,
    smoothed_signal,
)
from rsea_core.identify.locate.unknown_input_test import ALIKE, PLAIN_TO_SEE
from rsea_core.identify.selection.criteria import Search
from rsea_core.identify.smoothing.error_model import READING
from rsea_core.identify.smoothing.separability import SUBSYSTEM

FILE = "remainder.csv"
PEAK = 3.0  # of a signal, in its deviations
LOST_ANGLE = (GearBacklash.effect, GearTransmissionError.effect)
WHAT = {
    "V": ("voltage", "at the winding", "V"),
    "G": ("torque", "on the gear", "Nm"),
    "S": ("torque", "in the spring", "Nm"),
    "L": ("torque", "on the load", "Nm"),
    "E": ("torque", "of the contact", "Nm"),
}


@dataclass(frozen=True, kw_only=True)
class Trace:
    """The signal in one recording: times, values and standard deviations (n,)."""

    file: str
    time_s: NDArray
    value: NDArray
    std: NDArray


@dataclass(frozen=True, kw_only=True)
class UnexplainedResidual:
    """A mismatch without a law.

    Attributes
    ----------
    subsystem : str
    port : str
    fit : Fit
        The rig's values at their best jointly with the signal, replayed without it.
    covariance : (n, n) array
        Of the fit's unknowns.
    share : float
        Of the squared innovations above the noise, what the signal takes away.
    pace_s : float
        Correlation time of the signal.
    traces : tuple of Trace
    rivals : tuple of (subsystem, log-likelihood units behind)
    concentration : Concentration or None
        Where the signal (or its change) is concentrated.
    of_change : bool
        Whether that is of its change.
    table : Tabulated or None
        The signal as a table over a state that it follows, where one holds on unseen recordings.
    """

    subsystem: str
    port: str
    fit: Fit
    covariance: NDArray
    share: float
    pace_s: float
    traces: tuple[Trace, ...]
    rivals: tuple[tuple[str, float], ...]
    concentration: Concentration | None
    of_change: bool
    table: TableFit | None = None

    @property
    def unit(self) -> str:
        """Of the signal."""
        return self.port.rsplit("_", 1)[-1] if self.is_reading else WHAT[self.port][2]

    @property
    def is_reading(self) -> bool:
        """Whether it stands in a reading rather than in the machine."""
        return self.port.startswith(READING)

    @property
    def column(self) -> str:
        """The reading that errs; empty where it is the machine."""
        return self.port.removeprefix(READING) if self.is_reading else ""

    @property
    def what(self) -> str:
        """Phrase for the signal."""
        if self.is_reading:
            return f"error of the reading {self.column}"
        quantity, where, _ = WHAT[self.port]
        return f"{quantity} {where}"

    @property
    def label(self) -> str:
        """As the label of an axis, in two lines."""
        if self.is_reading:
            return f"unknown error\nof {self.column}"
        quantity, where, _ = WHAT[self.port]
        return f"unknown {quantity}\n{where}"

    @property
    def largest(self) -> tuple[float, str]:
        """Largest size, and the recording."""
        peaks = [(float(np.abs(t.value).max()), t.file) for t in self.traces]
        return max(peaks)

    def sentence(self) -> str:
        """What it is, how large, when."""
        peak, file = self.largest
        text = f"an unknown {self.what} of up to {peak:.3g} {self.unit} ({file})"
        if self.concentration is not None:
            part = "its change" if self.of_change else "it"
            text += f"; {self.concentration.sentence(part)}"
        return text if self.table is None else f"{text}; {self.table.sentence}"

    def columns(self) -> dict[str, NDArray]:
        """The signal as columns, the identification recordings numbered in their order."""
        numbers = [np.full(t.time_s.size, j + 1.0) for j, t in enumerate(self.traces)]
        return {
            "recording": np.concatenate(numbers),
            "time_s": np.concatenate([t.time_s for t in self.traces]),
            f"unknown_{self.unit}": np.concatenate([t.value for t in self.traces]),
            f"std_{self.unit}": np.concatenate([t.std for t in self.traces]),
        }

    def entry(self) -> dict:
        """As `diagnosis.json` has it."""
        return {
            "where": self.subsystem,
            "port": self.port,
            "unit": self.unit,
            "correlation_time_s": self.pace_s,
            "recordings": [
                {
                    "file": t.file,
                    "rms": float(np.sqrt(np.mean(t.value**2))),
                    "largest": float(np.abs(t.value).max()),
                }
                for t in self.traces
            ],
            "rivals": [{"where": name, "nats_behind": round(gap, 1)} for name, gap in self.rivals],
            "file": FILE,
            "words": self.sentence(),
        }


def unexplained_residual(search: Search) -> UnexplainedResidual | None:
    """The unexplained residual of a search's parameters; None where no port could carry one."""
    problem, start = search.problem, search.parameters
    ranked = ranked_ports(problem, start)
    ranked = [e for e in ranked if e.gain > 0.0]
    if not ranked:
        return None
    tried = sorted(
        (fit_jointly(problem, start, e) for e in ranked[: search.effort.signals]),
        key=lambda b: -b.log_posterior,
    )
    tables = [_table(search, b) for b in tried]
    best = _followed(search, tried, tables) or favoured_by_screening(search, tried)
    traces = []
    for index, prepared in enumerate(problem.fitted):
        time, value, std = smoothed_signal(problem, start.hypothesis, best, index)
        traces.append(Trace(file=prepared.recording.file, time_s=time, value=value, std=std))
    subsystem = _subsystem(search, best.ranked, traces)
    found, of_change = _concentrated(search, traces)
    rivals = {
        _owner(b.ranked.port): best.log_posterior - b.log_posterior
        for b in reversed(tried)
        if _owner(b.ranked.port) != subsystem and b is not best
    }
    return UnexplainedResidual(
        subsystem=subsystem,
        port=best.ranked.port,
        fit=_as_fit(search, best),
        covariance=best.covariance,
        share=best.share,
        pace_s=best.ranked.pace_s,
        traces=tuple(traces),
        rivals=tuple(sorted(rivals.items(), key=lambda item: item[1])),
        concentration=found,
        of_change=of_change,
        table=next(t for b, t in zip(tried, tables, strict=True) if b is best),
    )


def _table(search: Search, found: JointFit) -> TableFit | None:
    """The table that the error of a reading or a torque on the load follows."""
    port = found.ranked.port
    if port != "L" and not port.startswith(READING):
        return None
    peak = PEAK * float(found.ranked.levels.max())
    return table_fit(search, _as_fit(search, found), port.removeprefix(READING).strip("L"), peak)


def _followed(
    search: Search, tried: Sequence[JointFit], tables: Sequence[TableFit | None]
) -> JointFit | None:
    """Of the ports, that whose table alone brings every recording to the noise, the best if more.

    A few numbers that explain everything are the mismatch, wherever a signal with as many values
    as rows would fit as well.
    """
    down = [(search.score(t.fit), j) for j, t in enumerate(tables) if t is not None and t.quiet]
    return tried[max(down)[1]] if down else None


def _as_fit(search: Search, found: JointFit) -> Fit:
    """The values as a fit: what a replay without the signal leaves."""
    hypothesis = search.parameters.hypothesis
    costs, msnis, _ = search.fitter.evaluate(hypothesis, found.x[None])
    centre, weight = search.problem.prior(hypothesis)
    prior = 0.5 * float(np.sum((weight * (found.x - centre)) ** 2))
    return Fit(
        hypothesis=hypothesis, x=found.x, cost=float(costs[0]), prior_cost=prior, msni=msnis[0]
    )


def _owner(port: str) -> str:
    """The subsystem of a port."""
    return f"sensor:{port.removeprefix(READING)}" if port.startswith(READING) else SUBSYSTEM[port]


def favoured_by_screening(search: Search, tried: Sequence[JointFit]) -> JointFit:
    """Of the ports that nothing tells apart, that whose laws the screening liked best.

    A share alone is no measure of that: of a gain of millions it is more than any port gains on a
    machine without effect, and then the readings do tell. (A clamp that slips and a motor encoder
    that errs by as much are alike but for what the encoder itself says while it turns.)
    """
    best = tried[0]
    near = min(ALIKE * best.ranked.gain, PLAIN_TO_SEE)
    alike = [b for b in tried if best.log_posterior - b.log_posterior < near]
    for candidate in search.candidates:
        for b in alike:
            if candidate.law.subsystem == _owner(b.ranked.port):
                return b
    return best


def _subsystem(search: Search, entry: RankedPort, traces: Sequence[Trace]) -> str:
    """The port's subsystem; lost angle of the gear and the contact's torque have others' ports."""
    if entry.port == "S" and entry.pace_s <= OWN_PACE_s:
        return "gear"
    if entry.port == "S":  # laws that were fitted know more of it than those that were screened
        none = search.score(search.parameters)
        worth = (fit for fit in search.ranked() if search.score(fit) > none)
        fitted = (law for fit in worth for law in fit.hypothesis.laws)
        known = (*fitted, *(c.law for c in search.candidates))
        like = next((o for o in known if o.subsystem == "spring" or o.effect in LOST_ANGLE), None)
        return "gear" if like is not None and like.effect in LOST_ANGLE else "spring"
    if entry.port == "L":
        energy = [float(np.sum(t.value**2)) for t in traces]
        touching = [b.recording.load.kind == "contact" for b in search.problem.fitted]
        inside = sum(e for e, touches in zip(energy, touching, strict=True) if touches)
        near = next((c.law for c in search.candidates if c.law.subsystem == "environment"), None)
        if near is not None and not all(touching) and inside > IN_CONTACT * sum(energy):
            return "environment"
    return _owner(entry.port)


def _concentrated(search: Search, traces: Sequence[Trace]) -> tuple[Concentration | None, bool]:
    """The range of a state that holds most of the signal, or of its change."""
    recordings = search.short or search.problem.fitted
    best, of_change = None, False
    for change in (False, True):
        pooled: dict[tuple[str, str], list[tuple[NDArray, NDArray, int]]] = {}
        for prepared, trace in zip(recordings, traces, strict=True):
            weight = np.gradient(trace.value) ** 2 if change else trace.value**2
            length = max(1, round(BLOCK_s / np.median(np.diff(trace.time_s))))
            for name, values in _states(prepared, trace.time_s).items():
                pooled.setdefault(name, []).append((values, weight, length))
        for found in concentrations(pooled, 0)[:1]:
            if best is None or found.share - found.of_time > best.share - best.of_time:
                best, of_change = found, change
    return best, of_change


def _states(prepared: PreparedRecording, time_s: NDArray) -> Mapping[tuple[str, str], NDArray]:
    """What the signal may depend on, at given times, by (words, unit)."""
    found = {("the time", "s"): time_s - time_s[0]}
    if prepared.windows is None:
        return found
    plant, motion = machine_of(prepared.base), prepared.windows.motion
    rows = prepared.recording.time_s
    at = {j: np.interp(time_s, rows, motion[:, j]) for j in range(motion.shape[1])}
    found["the wheel's speed (either way)", "rad/s"] = np.abs(at[k.WW])
    found["the wheel's angle", "rad"] = at[k.TW]
    found["the time since the wheel last turned back", "s"] = since_reversal(time_s, at[k.WW])
    if plant.structure in (mp.ELASTIC_FREE, mp.ELASTIC_HELD):
        found["the deflection (either way)", "rad"] = np.abs(at[k.TW] - at[k.TL])
    if plant.structure in (mp.ELASTIC_FREE, mp.RIGID_FREE):
        found["the load's angle", "rad"] = at[k.TL]
    if np.any(at[k.IM]):
        found["the current (either way)", "A"] = np.abs(at[k.IM])
    return found
