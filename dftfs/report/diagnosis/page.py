"""What the report of a diagnosis shows, as plain data: it knows nothing of how it was found."""

from collections.abc import Mapping
from dataclasses import dataclass

from numpy.typing import NDArray

VERDICTS = {
    "no-mismatch": "The model explains these recordings",
    "parameters-only": "The model explains these recordings with other values",
    "missing-physics": "Physics is missing",
    "unexplained": "A mismatch that no known effect explains",
    "insufficient-data": "These recordings are not sufficient",
}
MEND_FIRST = "First correct the files"
SUBSYSTEMS = ("drive", "gear", "spring", "load", "environment")


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """One signal of one recording, simulated open loop three times.

    Attributes
    ----------
    file, role, description : str
    signal, unit : str
    time_s, recorded, before : (n,) arrays
    parameters_only, after : (n,) array or None
    noise_floor : float
        Standard deviation of the reading itself.
    nrmse_before, nrmse_parameters_only, nrmse_after : float or None
    """

    file: str
    role: str
    description: str
    signal: str
    unit: str
    time_s: NDArray
    recorded: NDArray
    before: NDArray
    parameters_only: NDArray | None
    after: NDArray | None
    noise_floor: float
    nrmse_before: float
    nrmse_parameters_only: float | None
    nrmse_after: float | None


@dataclass(frozen=True, kw_only=True)
class Score:
    """Errors of one signal of one recording, for the table of all of them."""

    file: str
    role: str
    signal: str
    unit: str
    noise_floor: float
    rmse_before: float
    rmse_parameters_only: float | None
    rmse_after: float | None


@dataclass(frozen=True, kw_only=True)
class PortTrace:
    """The unknown torque (volts at the drive) of one port in one recording, with its error bar."""

    port: str
    label: str
    unit: str
    file: str
    time_s: NDArray
    value: NDArray
    std: NDArray


@dataclass(frozen=True, kw_only=True)
class TimeStrip:
    """How large the mismatch of one recording is over time, in noise floors.

    ``edges_s`` is (m + 1,), ``level`` (m,).
    """

    file: str
    edges_s: NDArray
    level: NDArray


@dataclass(frozen=True, kw_only=True)
class StateMap:
    """Mean mismatch over two quantities; nan where the recordings have no samples."""

    x_label: str
    y_label: str
    x_edges: NDArray  # (p + 1,)
    y_edges: NDArray  # (q + 1,)
    level: NDArray  # (q, p), in noise floors
    sentence: str


@dataclass(frozen=True, kw_only=True)
class ParameterRow:
    """A value that was found or corrected."""

    name: str
    unit: str
    value: float
    std: float | None
    nominal: float | None = None
    note: str = ""


@dataclass(frozen=True, kw_only=True)
class EffectCard:
    """An effect that was found."""

    name: str
    subsystem: str
    confidence: float
    law: str
    words: str
    parameters: tuple[ParameterRow, ...]
    alike: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """An explanation that was considered; those of a page are its ranked explanations.

    Attributes
    ----------
    error : float
        Its error over the noise floor.
    gain : float
        Of log score over parameters alone.
    se : float
        Standard error of its distance to the chosen one.
    """

    name: str
    subsystem: str
    error: float
    gain: float
    se: float
    chosen: bool = False
    note: str = ""


@dataclass(frozen=True, kw_only=True)
class LawCurve:
    """The law that was identified, with its 95 % band, beside the nominal one."""

    title: str
    x_label: str
    y_label: str
    x: NDArray
    nominal: NDArray
    found: NDArray
    low: NDArray
    high: NDArray
    points: tuple[NDArray, NDArray] | None = None
    caption: str = ""


@dataclass(frozen=True, kw_only=True)
class Remainder:
    """What is left after the model found, signal by signal, over the noise floor."""

    words: str
    signals: tuple[str, ...]
    before: NDArray  # held-out error over the floor, (k,)
    parameters_only: NDArray
    after: NDArray


@dataclass(frozen=True, kw_only=True)
class NextExperiment:
    """The recording that would decide between the remaining explanations."""

    sentence: str
    file: str
    load: str
    sensors: tuple[str, ...]
    separation: float
    threshold: float
    rivals: tuple[str, str]
    command_label: str
    time_s: NDArray
    command: NDArray
    signal: str
    unit: str
    predicted: tuple[NDArray, NDArray]


@dataclass(frozen=True, kw_only=True)
class DiagnosisPage:
    """Everything that the page shows.

    Attributes
    ----------
    case, rig : str
    verdict : str
        A key of `VERDICTS`.
    summary : str
        One or two sentences that state what to do.
    subsystem : str or None
        Where most of the mismatch arises: one of `SUBSYSTEMS` or "sensor:<column>".
    where : str
        When, at which speed, angle and load, in words.
    shares : mapping of str to float
        Share of the mismatch that no parameter explains, by subsystem.
    parts, sensors : tuple of str
        What the machine has, and the columns that were read.
    loads : tuple of str
    separability : str
        What these sensors can tell apart.
    doubted : bool
        Whether the files contain errors that must be corrected first.
    weighed : str
        On what the ranked explanations were weighed.
    comparisons : tuple of Comparison
        Held-out recordings first.
    record_next : str
        What to record next, in a sentence, where no `next_experiment` draws it.
    findings : tuple of str
    facts : tuple of (str, str)
        How the result came about: program, time, recordings.
    """

    case: str
    rig: str
    verdict: str
    summary: str
    subsystem: str | None
    where: str
    shares: Mapping[str, float]
    parts: tuple[str, ...]
    sensors: tuple[str, ...]
    loads: tuple[str, ...]
    separability: str
    doubted: bool = False
    effects: tuple[EffectCard, ...] = ()
    parameters: tuple[ParameterRow, ...] = ()
    comparisons: tuple[Comparison, ...] = ()
    scores: tuple[Score, ...] = ()
    traces: tuple[PortTrace, ...] = ()
    strips: tuple[TimeStrip, ...] = ()
    state_map: StateMap | None = None
    signatures: tuple[str, ...] = ()
    ladder: tuple[Candidate, ...] = ()
    weighed: str = ""
    laws: tuple[LawCurve, ...] = ()
    remainder: Remainder | None = None
    next_experiment: NextExperiment | None = None
    record_next: str = ""
    findings: tuple[str, ...] = ()
    facts: tuple[tuple[str, str], ...] = ()

    @property
    def headline(self) -> str:
        """The verdict in words, with the effects' names; what must be mended before the rest."""
        named = [e.name for e in self.effects if e.confidence >= 0.5]
        if self.verdict == "missing-physics" and named:
            return "Missing: " + " and ".join(name.replace("-", " ") for name in named)
        return MEND_FIRST if self.doubted else VERDICTS[self.verdict]


def page_from(data: Mapping) -> DiagnosisPage:
    """A page from plain data with the page's own names, as a diagnosis reports itself.

    Raises
    ------
    TypeError
        If the data has a name that the page does not know, or lacks one that it needs.
    """
    parts = {
        "effects": lambda e: EffectCard(
            **(e | {"parameters": tuple(ParameterRow(**row) for row in e["parameters"])})
        ),
        "parameters": lambda row: ParameterRow(**row),
        "comparisons": lambda row: Comparison(**row),
        "scores": lambda row: Score(**row),
        "traces": lambda row: PortTrace(**row),
        "strips": lambda row: TimeStrip(**row),
        "ladder": lambda row: Candidate(**row),
        "laws": lambda row: LawCurve(**row),
    }
    whole = {"state_map": StateMap, "remainder": Remainder, "next_experiment": NextExperiment}
    found = dict(data)
    for name, make in parts.items():
        found[name] = tuple(make(item) for item in data.get(name, ()))
    for name, make in whole.items():
        given = data.get(name)
        found[name] = None if given is None else make(**given)
    for name in ("findings", "facts", "signatures", "parts", "sensors", "loads"):
        found[name] = tuple(data.get(name, ()))
    return DiagnosisPage(**found)
