"""model.toml: the rig, corrected, and its terms; what a diagnosis leaves to simulations.

    [rig]                      as in a rig.toml, with [tolerances] and [anchor] where given
    ...
    [[term]]
    effect = "spring-hysteresis"
    law = "maxwell-slip"       may be absent: the effect's first law
    stiffness_1_Nm_per_rad = 12.5

    [found]                    of a diagnosis: ambient temperature, changes of a contact
    [[law]]                    of a diagnosis: read as the term that it stands for
    effect = "motor-cogging"
    law = "6 per turn"
    [law.values]

Numbers are written so that reading them back gives the same ones to the bit.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rsea_core.effects.registry import Term
from rsea_core.effects.variant import Law
from rsea_core.errors import RigError, RseaError, TermError
from rsea_core.files.text_files import write_whole
from rsea_core.files.toml_tables import number, read_toml, require_known, table
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.model.diagnosed_effects import (
    BETWEEN_KEY,
    FOUND_KEYS,
    HEAT_KEYS,
    REST_KEY,
    MappedLaws,
    map_laws,
    read_laws,
)
from rsea_core.terms.tables import term_from_table, term_to_toml

TABLES = ("rig", "tolerances", "anchor", "term", "found", "law")
OF_A_CASE = ("recording", "columns")  # of a rig file, which a model file may be
AMBIENT_C = 25.0


@dataclass(frozen=True, kw_only=True)
class ModelFile:
    """What a `model.toml` holds.

    Attributes
    ----------
    rig : Rig
    terms : tuple of Term
        Those written as terms.
    laws : tuple of (Law, values)
        Those of a diagnosis.
    contact : mapping
        Factors of stiffness and damping of contacts, shift of their angle.
    ambient_C : float
    initial_rises_K : (float, float) or None
        Rise of winding and case when a diagnosis' last recording ended.
    rest_rad : float
        How far from slack a wheel with play rests before a test.
    command_between_rows : "held" or "linear"
        How the recordings' command moved from a row to the next.
    """

    rig: Rig
    terms: tuple[Term, ...]
    laws: tuple[tuple[Law, Mapping[str, float]], ...]
    contact: Mapping[str, float]
    ambient_C: float
    initial_rises_K: tuple[float, float] | None = None
    rest_rad: float = 0.0
    command_between_rows: str = "held"

    @property
    def mapped(self) -> MappedLaws:
        """The laws as terms."""
        return map_laws(self.rig, self.laws, ambient_C=self.ambient_C, contact=self.contact)

    @property
    def model(self) -> ActuatorModel:
        """The machine as simulations and controllers take it.

        Raises
        ------
        TermError
            If two terms are laws of one thing.
        """
        given = tuple(term for term in self.mapped.terms if term is not None)
        return ActuatorModel(self.rig, (*given, *self.terms))

    @property
    def notes(self) -> tuple[str, ...]:
        """What a simulation of `model` goes without, a sentence each."""
        mapped, starts = self.mapped, []
        if self.initial_rises_K is not None:
            winding, case = self.initial_rises_K
            starts.append(
                f"a simulation begins cold; the recordings left the winding {winding:.1f} K and the"
                f" case {case:.1f} K warmer than the air"
            )
        if self.rest_rad > 0.0:
            starts.append(
                "a simulation begins with the wheel in its play where the spring is slack; in the"
                f" recordings it rested up to {self.rest_rad:.2g} rad from there"
            )
        return (*mapped.left_out, *mapped.aside, *starts)


def read_model_file(path: str | Path) -> ModelFile:
    """What a `model.toml` holds; the `rig.toml` of a case is one too.

    Raises
    ------
    RseaError
        If the file cannot be read, has an unknown key or a value that cannot be used; the
        message names file, term and key.
    """
    tables = read_toml(path, TermError)
    require_known(tables, (*TABLES, *OF_A_CASE), str(path), TermError)
    rest = {key: tables.pop(key) for key in ("term", "law", "found") if key in tables}
    listed = rest.get("term", [])
    if not isinstance(listed, list):
        raise TermError(f"{path}: term must be a list, each one written [[term]]")
    rig = Rig.from_tables(tables, where=str(path))
    found = table(rest.get("found", {}), f"{path}: found", RigError)
    require_known(found, FOUND_KEYS, f"{path}: found", RigError)
    between = found.pop(BETWEEN_KEY, "held")
    if between not in ("held", "linear"):
        raise RigError(f'{path}: found: {BETWEEN_KEY} = {between!r} must be "held" or "linear"')
    values = {key: number(v, f"{path}: found: {key}", RigError) for key, v in found.items()}
    ambient_C = values.pop("ambient_C", AMBIENT_C)
    rest_rad = values.pop(REST_KEY, 0.0)
    left = tuple(values.pop(key) for key in HEAT_KEYS if key in values)
    laws = read_laws(rest.get("law", []), str(path))
    try:
        terms = tuple(term_from_table(t, i) for i, t in enumerate(listed, 1))
        held = ModelFile(
            rig=rig, terms=terms, laws=laws, contact=values, ambient_C=ambient_C,
            initial_rises_K=left if len(left) == len(HEAT_KEYS) else None, rest_rad=rest_rad,
            command_between_rows=between,
        )  # fmt: skip
        held.model  # noqa: B018 - whether it is one model
    except RseaError as problem:
        raise TermError(f"{path}: {problem}") from problem
    return held


def read_model(path: str | Path) -> ActuatorModel:
    """The model of a `model.toml`; the `rig.toml` of a case is one too.

    Laws of a diagnosis become terms; what a model cannot hold of them is in
    `read_model_file(path).notes`.

    Raises
    ------
    RseaError
        As `read_model_file`.
    """
    return read_model_file(path).model


def write_model(model: ActuatorModel, path: str | Path) -> Path:
    """Write a model; the file appears whole or not at all.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    return write_whole(path, model_to_toml(model))


def model_to_toml(model: ActuatorModel) -> str:
    """The text of a `model.toml`."""
    return "\n".join([model.rig.to_toml(), *map(term_to_toml, model.terms)])
