"""The result of a diagnosis."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from rsea_core.files.csv_columns import write_columns
from rsea_core.files.text_files import to_json, write_whole
from rsea_core.identify.experiment.experiment_file import FILE as NEXT
from rsea_core.identify.judgement.residual import FILE as REMAINDER
from rsea_core.identify.result.corrected_model import FoundModel
from rsea_core.identify.result.document_text import brief_text
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.finding import Finding

DOCUMENT, MODEL, NEXT_TOML = "diagnosis.json", "model.toml", "next.toml"
SOMETIMES = (NEXT, REMAINDER, NEXT_TOML)  # files that not every diagnosis has


@dataclass(frozen=True, kw_only=True, repr=False)
class Diagnosis:
    """Where recordings and rig file differ, what explains it, and the model found.

    `print` shows the verdict, each effect with its confidence and figures, and the notes.

    Attributes
    ----------
    document : dict
        `diagnosis.json` (docs/recordings.md): plain data, SI and radians.
    model : FoundModel
        What `predict` takes; `model.notes` says what a simulation goes without.
    conclusion : Conclusion, MapDiagnosis or SpringConclusion
        What it was made from, for reports.
    findings : tuple of Finding
        Those of the document, as data.
    next_columns : mapping of name -> (n,) array, or None
        Inputs of the next experiment, ready to run; None where nothing is open.
    next_recording : str or None
        The [[recording]] table of the next experiment.
    unexplained_columns : mapping of name -> (n,) array, or None
        The signal that no effect explains, as `remainder.csv` has it.
    report_data : callable
        Makes the plain data of a report.
    """

    document: dict
    model: FoundModel
    conclusion: Any
    findings: tuple[Finding, ...] = ()
    next_columns: Mapping[str, NDArray] | None = None
    next_recording: str | None = None
    unexplained_columns: Mapping[str, NDArray] | None = None
    report_data: Callable[[], dict] = dict

    @property
    def verdict(self) -> str:
        """`no-mismatch`, `parameters-only`, `missing-physics`, `unexplained` or
        `insufficient-data`."""
        return self.document["verdict"]

    @property
    def summary(self) -> str:
        """One or two sentences."""
        return self.document["summary"]

    @property
    def effects(self) -> list[dict]:
        """The effects found: name, subsystem, confidence, law, parameters, class, alternatives."""
        return self.document["effects"]

    @property
    def next_experiment(self) -> dict | None:
        """What to record next; None where nothing is open or no experiment would settle it."""
        return self.document["next_experiment"]

    def actuator_model(self) -> ActuatorModel:
        """The corrected machine with its laws, for simulations and controllers.

        Raises
        ------
        TermError
            If two laws are of one thing.
        """
        return self.model.model

    def save(self, folder: str | Path) -> dict[str, Path]:
        """Write `diagnosis.json` and `model.toml`, as `dftfs diagnose` does, without its report.

        Where there are any: `next.csv` and `next.toml` (the next experiment), `remainder.csv`
        (the signal that no effect explains). The folder is made; older files of these names are
        replaced, or removed where this diagnosis has none.

        Returns
        -------
        dict of file name -> Path

        Raises
        ------
        OSError, RseaError
            If a file cannot be written.
        """
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        paths = {
            DOCUMENT: write_whole(folder / DOCUMENT, to_json(self.document)),
            MODEL: write_whole(folder / MODEL, self.model.to_toml()),
        }
        for name, columns in ((NEXT, self.next_columns), (REMAINDER, self.unexplained_columns)):
            if columns is not None:
                paths[name] = write_columns(folder / name, columns)
        if self.next_recording is not None:
            paths[NEXT_TOML] = write_whole(folder / NEXT_TOML, self.next_recording)
        remove_older(folder, paths)
        return paths

    def having(self, finding: Finding) -> "Diagnosis":
        """The same with a further finding."""
        document = self.document | {"findings": [*self.document["findings"], finding.sentence()]}
        return replace(self, document=document, findings=(*self.findings, finding))

    def __repr__(self) -> str:
        return brief_text(self.document)


def remove_older(folder: Path, names: Collection[str]) -> None:
    """Remove the files of an older diagnosis that one with these files does not have."""
    for name in SOMETIMES:
        if name not in names:
            (folder / name).unlink(missing_ok=True)
