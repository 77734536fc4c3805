"""The model that a diagnosis found, as a file, and its predictions of unseen inputs.

`model.toml` holds the corrected rig and a [[law]] for each effect: name of effect and law, the
column or recording that it is about, and its values. Predictions put these values straight into
the fast engine, as the fit did; simulations and controllers read the same file as a model with
terms (`model_file`, `found_terms`), which comments in it show.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rsea_core.case import InputRecording
from rsea_core.csv_columns import write_columns
from rsea_core.identify.found_terms import HEAT_KEYS, map_laws
from rsea_core.identify.heat import CASE_J_per_K, heat_of_the_past
from rsea_core.identify.law import PLANT, Draft, Law, Where
from rsea_core.identify.problem import Problem, predict_drafts
from rsea_core.model import ActuatorModel
from rsea_core.model_file import AMBIENT_C, read_model_file, term_to_toml
from rsea_core.replay import Replay
from rsea_core.rig import Rig
from rsea_core.terms import Port, Term

CONTACT = {
    "contact_stiffness_Nm_per_rad": ("contact_stiffness", False),
    "contact_damping_Nms_per_rad": ("contact_damping", False),
    "contact_angle_rad": ("contact_angle", True),
}
PREDICTED = ("motor_angle_rad", "load_angle_rad", "torque_Nm")


@dataclass(frozen=True, kw_only=True)
class FoundModel:
    """A corrected rig and its laws.

    Attributes
    ----------
    contact : mapping
        Factors of stiffness and damping of contacts, shift of their angle.
    laws : tuple of (Law, values)
    ambient_C : float
    terms : tuple of Term
        More physics, written into the file by hand.
    left_K : (float, float) or None
        Rise of a warming motor's winding and case when the last recording ended.
    """

    rig: Rig
    contact: Mapping[str, float]
    laws: tuple[tuple[Law, Mapping[str, float]], ...]
    ambient_C: float = AMBIENT_C
    terms: tuple[Term, ...] = ()
    left_K: tuple[float, float] | None = None

    def to_toml(self) -> str:
        """The text of `model.toml`."""
        mapped = map_laws(self.rig, self.laws, ambient_C=self.ambient_C, contact=self.contact)
        lines = [self.rig.to_toml(), "[found]", f"ambient_C = {self.ambient_C!r}"]
        lines += [f"{key} = {float(value)!r}" for key, value in self.contact.items()]
        if self.left_K is not None:
            pairs = zip(HEAT_KEYS, self.left_K, strict=True)
            lines += [f"{key} = {float(value)!r}" for key, value in pairs]
        said = [*mapped.left_out, *mapped.aside]
        lines += ["", *(f"# simulations: {note}" for note in said)] if said else []
        for (law, values), term in zip(self.laws, mapped.terms, strict=True):
            lines += ["", "[[law]]", f'effect = "{law.effect}"', f'law = "{law.law}"']
            if law.sensor is not None:
                lines.append(f'column = "{law.sensor}"')
            if law.only is not None:
                lines.append(f'recording = "{law.only}"')
            if term is not None:
                lines.append(f"# simulated as {term.effect}, {term.law}: {term.equation()}")
            lines += ["[law.values]", *(f"{k} = {float(v)!r}" for k, v in values.items())]
        for term in self.terms:
            lines += ["", term_to_toml(term).rstrip()]
        return "\n".join(lines) + "\n"

    @classmethod
    def from_toml(cls, path: str | Path) -> "FoundModel":
        """Read a `model.toml`.

        Raises
        ------
        RseaError
            If the file cannot be read, or a law is not known.
        """
        held = read_model_file(path)
        return cls(
            rig=held.rig, contact=held.contact, laws=held.laws, ambient_C=held.ambient_C,
            terms=held.terms, left_K=held.left_K,
        )  # fmt: skip

    def predict(self, test: InputRecording) -> dict[str, NDArray]:
        """Readings that this model expects of unseen inputs: time and `PREDICTED`."""
        inputs = test.inputs
        replay = Replay.of(inputs, supply_V=test.supply_V, drive_enabled=test.drive_enabled)
        base = replay.numbers(ActuatorModel(self.rig, self.terms))
        warm, left = 0.0, None
        if test.initial_temperature_C is not None:
            warm, left = max(test.initial_temperature_C - self.ambient_C, 0.0), self.left_K
        where = Where(
            index=-1, file=test.file, kind=inputs.load.kind, ratio=self.rig.gear_ratio or 1.0,
            session_s=0.0, case_rise_K=warm, time_s=np.array(inputs.time_s), left_K=left,
        )  # fmt: skip
        draft = Draft(
            plant=base.plant.copy(),
            fx=base.fx.copy(),
            stiffness=self.rig.spring_stiffness_Nm_per_rad or 0.0,
            spring=base.spring if any(t.port is Port.SPRING for t in self.terms) else None,
        )
        for key, (name, shift) in CONTACT.items():
            if key in self.contact:
                value = draft.plant[PLANT[name]]
                draft.plant[PLANT[name]] = (
                    value + self.contact[key] if shift else value * self.contact[key]
                )
        for law, values in self.laws:
            if law.only is None:
                law.write(values, draft, where)
        readings = predict_drafts(replay, [draft], PREDICTED, where)[0]
        columns = {"time_s": np.array(inputs.time_s)}
        for j, name in enumerate(PREDICTED):
            part = {"motor_angle_rad": "gear", "torque_Nm": "spring"}.get(name)
            if part is None or self.rig.has(part):
                columns[name] = readings[:, j]
        return columns


def heat_left(
    problem: Problem, laws: tuple[tuple[Law, Mapping[str, float]], ...], resistance_ohm: float
) -> tuple[float, float] | None:
    """Rise of winding and case [K] at the end of a session; None of a motor that does not warm.

    A measured case is as warm as it reads; the winding is above it by what the currents say.
    """
    values = next((v for law, v in laws if law.effect == "drive-thermal"), None)
    if values is None:
        return None
    capacity = values["winding_heat_capacity_J_per_K"]
    winding, case = heat_of_the_past(
        problem.heat, resistance_ohm, capacity, capacity / values["winding_time_s"],
        CASE_J_per_K, values["pause_s"],
    )  # fmt: skip
    last = problem.benches[-1]
    if "temperature_C" not in last.recording:
        return winding, case
    read = last.recording["temperature_C"]
    few = max(5, last.recording.rows // 200)
    warm = last.where.case_rise_K + float(np.mean(read[-few:]) - np.mean(read[:few]))
    return warm + winding - case, warm


def write_prediction(model: FoundModel, test: InputRecording, path: Path) -> Path:
    """Predict and write a CSV."""
    return write_columns(path, model.predict(test))
