"""The model that a diagnosis found, as a file, and its predictions of unseen inputs.

`model.toml` holds the corrected rig and a [[law]] for each effect: name of effect and law, the
column or recording that it is about, and its values. A machine prepared from it runs on the fast
engine.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rsea_core.case import InputRecording
from rsea_core.csv_columns import write_columns
from rsea_core.effects import N_EFFECTS
from rsea_core.errors import RigError
from rsea_core.identify.catalogue import laws_by_key
from rsea_core.identify.laws import PLANT, Draft, Law, Where
from rsea_core.identify.problem import predict_drafts
from rsea_core.model import ActuatorModel
from rsea_core.replay import Replay
from rsea_core.rig import Rig
from rsea_core.tables import nearest, number, read_toml, table

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
    """

    rig: Rig
    contact: Mapping[str, float]
    laws: tuple[tuple[Law, Mapping[str, float]], ...]
    ambient_C: float

    def to_toml(self) -> str:
        """The text of `model.toml`."""
        lines = [self.rig.to_toml(), "[found]", f"ambient_C = {self.ambient_C!r}"]
        lines += [f"{key} = {float(value)!r}" for key, value in self.contact.items()]
        for law, values in self.laws:
            lines += ["", "[[law]]", f'effect = "{law.effect}"', f'law = "{law.law}"']
            if law.sensor is not None:
                lines.append(f'column = "{law.sensor}"')
            if law.only is not None:
                lines.append(f'recording = "{law.only}"')
            lines += ["[law.values]", *(f"{k} = {float(v)!r}" for k, v in values.items())]
        return "\n".join(lines) + "\n"

    @classmethod
    def from_toml(cls, path: str | Path) -> "FoundModel":
        """Read a `model.toml`.

        Raises
        ------
        RigError
            If the file cannot be read, or a law is not known.
        """
        tables = read_toml(path, RigError)
        rest = {key: tables.pop(key) for key in ("found", "law") if key in tables}
        rig = Rig.from_tables(tables, where=str(path))
        found = table(rest.get("found", {}), "found", RigError)
        laws = []
        known = laws_by_key()
        for entry in rest.get("law", []):
            key = f"{entry.get('effect')}/{entry.get('law')}"
            if entry.get("column"):
                key += f"@{entry['column']}"
            plain = key if key in known else f"{entry.get('effect')}/*"
            if plain not in known:
                raise RigError(f"{path}: unknown law {key!r}; {nearest(key, known)}")
            values = {
                name: number(v, f"{path}: law {key}: {name}", RigError)
                for name, v in table(entry.get("values", {}), "law.values", RigError).items()
            }
            laws.append((known[plain], values))
        return cls(
            rig=rig,
            contact={k: found[k] for k in CONTACT if k in found},
            laws=tuple(laws),
            ambient_C=float(found.get("ambient_C", 25.0)),
        )

    def predict(self, test: InputRecording) -> dict[str, NDArray]:
        """Readings that this model expects of unseen inputs: time and `PREDICTED`."""
        inputs = test.inputs
        replay = Replay.of(inputs, supply_V=test.supply_V, drive_enabled=test.drive_enabled)
        base = replay.numbers(ActuatorModel(self.rig))
        warm = 0.0
        if test.initial_temperature_C is not None:
            warm = max(test.initial_temperature_C - self.ambient_C, 0.0)
        where = Where(
            index=-1, file=test.file, kind=inputs.load.kind, ratio=self.rig.gear_ratio or 1.0,
            session_s=0.0, case_rise_K=warm, time_s=np.array(inputs.time_s),
        )  # fmt: skip
        draft = Draft(
            plant=base.plant.copy(),
            fx=np.zeros(N_EFFECTS),
            stiffness=self.rig.spring_stiffness_Nm_per_rad or 0.0,
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


def write_prediction(model: FoundModel, test: InputRecording, path: Path) -> Path:
    """Predict and write a CSV."""
    return write_columns(path, model.predict(test))
