"""The diagnosis of recordings that are not replayed: a spring's loops, a map of steady speeds."""

from dataclasses import dataclass
from functools import partial

from rsea_core.effects.registry import SpringCurve
from rsea_core.errors import InputError
from rsea_core.identify.result.corrected_model import FoundModel
from rsea_core.identify.result.diagnosis import Diagnosis
from rsea_core.identify.spring_bench.diagnose import diagnose_bench, is_spring_bench
from rsea_core.identify.spring_bench.next_loop import next_loop
from rsea_core.identify.spring_bench.report_data import spring_report_data
from rsea_core.identify.steady_map.diagnose import diagnose_map
from rsea_core.model.model_file import model_to_toml
from rsea_core.recordings.case import Case


@dataclass(frozen=True, kw_only=True)
class SpringModel(FoundModel):
    """The model of a spring's bench: rig and terms, nothing of a session."""

    def to_toml(self) -> str:
        """The text of `model.toml`, without [found]."""
        return model_to_toml(self.model)


def require_spring_bench(case: Case, given: str) -> None:
    """Refuse a design to compare with where no spring is measured.

    Parameters
    ----------
    given : str
        What the caller named the design with.

    Raises
    ------
    InputError
        If the case is no spring's bench.
    """
    if not is_spring_bench(case):
        raise InputError(
            f"{given}: {case.name} is no spring test bench; that records torque_Nm"
            " against deflection, quasi-statically or without a moving machine"
        )


def diagnose_spring_bench(case: Case, design: SpringCurve | None = None) -> Diagnosis:
    """A spring against its design, from its loops.

    Raises
    ------
    InputError
        As `diagnose_bench`.
    """
    conclusion = diagnose_bench(case, design)
    loop, model = next_loop(conclusion), conclusion.model()
    document = conclusion.document() | {"next_experiment": None if loop is None else loop.entry}
    return Diagnosis(
        document=document,
        model=SpringModel(rig=model.rig, contact={}, laws=(), terms=model.terms),
        conclusion=conclusion,
        findings=conclusion.findings(),
        next_columns=None if loop is None else loop.columns,
        next_recording=None if loop is None else loop.recording_toml,
        report_data=partial(spring_report_data, conclusion, document),
    )


def diagnose_steady_map(case: Case) -> Diagnosis:
    """A drive's friction, from its map of steady speeds.

    Raises
    ------
    RecordingError
        As `diagnose_map`.
    """
    found = diagnose_map(case)
    return Diagnosis(
        document=found.document,
        model=found.model,
        conclusion=found,
        findings=found.findings,
        next_columns=found.next_columns,
        report_data=partial(getattr, found, "report_data"),
    )
