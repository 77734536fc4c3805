"""The model that a diagnosis found, as a file, and its predictions of unseen inputs.

`model.toml` holds the corrected rig and a [[law]] for each effect: name of effect and law, the
column or recording that it is about, and its values. Predictions put these values straight into
the fixed-step engine, as the fit did; simulations and controllers read the same file as a model
with terms (`model_file`, `diagnosed_effects`), which comments in it show.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import rsea_core.effects.layout as fx
from rsea_core.effects.drive_thermal import CASE_J_per_K, DriveThermal, initial_rises
from rsea_core.effects.gear_backlash import GearBacklash
from rsea_core.effects.registry import Port, Term
from rsea_core.effects.sensor_reading import reading
from rsea_core.effects.variant import PLANT, Law, RunConditions, TrialMachine
from rsea_core.engines.fixed_step.replay import Replay
from rsea_core.files.csv_columns import write_columns
from rsea_core.identify.fitting.problem import Problem, predict_readings
from rsea_core.machine.command_motion import FINER, between_rows
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.model.diagnosed_effects import BETWEEN_KEY, HEAT_KEYS, REST_KEY
from rsea_core.model.model_file import AMBIENT_C, ModelFile, read_model_file
from rsea_core.recordings.case import InputRecording
from rsea_core.terms.tables import term_to_toml

CONTACT = {
    "contact_stiffness_Nm_per_rad": ("contact_stiffness", False),
    "contact_damping_Nms_per_rad": ("contact_damping", False),
    "contact_angle_rad": ("contact_angle", True),
}
PLACES = 9  # of a wheel in its play, over which a prediction is averaged
PREDICTED = ("motor_angle_rad", "load_angle_rad", "torque_Nm")
Laws = tuple[tuple[Law, Mapping[str, float]], ...]


@dataclass(frozen=True, kw_only=True)
class FoundModel(ModelFile):
    """A corrected rig and its laws, as `model.toml` holds them.

    `terms` are more physics, written into the file by hand; `model` is the machine with all of it,
    for simulations.
    """

    terms: tuple[Term, ...] = ()
    ambient_C: float = AMBIENT_C

    def to_toml(self) -> str:
        """The text of `model.toml`."""
        mapped = self.mapped
        lines = [self.rig.to_toml(), "[found]", f"ambient_C = {self.ambient_C!r}"]
        lines += [f"{key} = {float(value)!r}" for key, value in self.contact.items()]
        if self.initial_rises_K is not None:
            pairs = zip(HEAT_KEYS, self.initial_rises_K, strict=True)
            lines += [f"{key} = {float(value)!r}" for key, value in pairs]
        lines += [f"{REST_KEY} = {float(self.rest_rad)!r}"] if self.rest_rad > 0.0 else []
        notes = [*mapped.left_out, *mapped.aside]
        if self.command_between_rows != "held":
            lines.append(f'{BETWEEN_KEY} = "{self.command_between_rows}"')
        lines += ["", *(f"# simulations: {note}" for note in notes)] if notes else []
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
        return cls(**{f.name: getattr(held, f.name) for f in fields(held)})

    def predict(self, test: InputRecording) -> dict[str, NDArray]:
        """Readings that this model expects of unseen inputs: time and `PREDICTED`.

        Where in its play a wheel rests nobody knows before a test: the mean over the places.
        """
        inputs, more = test.inputs, {}
        if test.supply_V is not None:
            more["supply_V"] = test.supply_V
        if test.drive_enabled is not None:
            more["drive_enabled"] = test.drive_enabled
        linear = self.command_between_rows == "linear" and inputs.load.kind != "imposed"
        finer = FINER if linear and inputs.command_name else 1
        if finer > 1:
            inputs, more = between_rows(inputs, more, finer)
        if self.rig.parts == ("spring",) and inputs.load_angle_rad is not None:
            # nothing else moves: the hub is held, and the deflection is given
            replay = Replay(time_s=inputs.time_s, spring_deflection_rad=-inputs.load_angle_rad)
        else:
            replay = Replay.of(inputs, **more)
        base = replay.numbers(ActuatorModel(self.rig, self.terms))
        warm, left = 0.0, None
        if test.initial_temperature_C is not None:
            warm, left = max(test.initial_temperature_C - self.ambient_C, 0.0), self.initial_rises_K
        where = RunConditions(
            index=-1, file=test.file, kind=inputs.load.kind, ratio=self.rig.gear_ratio or 1.0,
            session_s=0.0, case_rise_K=warm, time_s=np.array(inputs.time_s), initial_rises_K=left,
        )  # fmt: skip
        trial = TrialMachine(
            plant=base.plant.copy(),
            fx=base.fx.copy(),
            stiffness=self.rig.spring_stiffness_Nm_per_rad or 0.0,
            spring=base.spring if any(t.port is Port.SPRING for t in self.terms) else None,
        )
        for key, (name, shift) in CONTACT.items():
            if key in self.contact:
                value = trial.plant[PLANT[name]]
                trial.plant[PLANT[name]] = (
                    value + self.contact[key] if shift else value * self.contact[key]
                )
        for law, values in self.laws:
            if law.only is None:
                law.write(values, trial, where)
        trials = [trial]
        if self.rest_rad > 0.0 and trial.fx[fx.BACKLASH] > 0.0:
            places = self.rest_rad * (2.0 * np.arange(PLACES) + 1.0 - PLACES) / PLACES
            trials = [replace(trial, start_deflection_rad=deflection) for deflection in places]
        readings = predict_readings(replay, trials, PREDICTED, where).mean(axis=0)[::finer]
        columns = {"time_s": np.array(test.inputs.time_s)}
        for j, name in enumerate(PREDICTED):
            part = {"motor_angle_rad": "gear", "torque_Nm": "spring"}.get(name)
            moves = name == "torque_Nm" or self.rig.parts != ("spring",)
            if moves and (part is None or self.rig.has(part)):
                columns[name] = reading(self.terms, name, columns["time_s"], readings[:, j])
        return columns


def heat_left(problem: Problem, laws: Laws, resistance_ohm: float) -> tuple[float, float] | None:
    """Rise of winding and case [K] at the end of a session; None of a motor that does not warm.

    A measured case is as warm as it reads; the winding is above it by what the currents say.
    """
    values = next((v for law, v in laws if law.effect == DriveThermal.effect), None)
    if values is None:
        return None
    capacity = values["winding_heat_capacity_J_per_K"]
    winding, case = initial_rises(
        problem.heat, resistance_ohm, capacity, capacity / values["winding_time_s"],
        CASE_J_per_K, values["pause_s"],
    )  # fmt: skip
    last = problem.prepared[-1]
    if "temperature_C" not in last.recording:
        return winding, case
    read = last.recording["temperature_C"]
    few = max(5, last.recording.rows // 200)
    warm = last.where.case_rise_K + float(np.mean(read[-few:]) - np.mean(read[:few]))
    return warm + winding - case, warm


def rest_of(problem: Problem, laws: Laws, stiffness: float) -> float:
    """How far from slack [rad] a wheel rests in its play when recordings begin, 0 without play.

    Half the width of the even spread that has the variance of the springs' first torques.
    """
    width = next((v["width_rad"] for law, v in laws if law.effect == GearBacklash.effect), 0.0)
    if width <= 0.0 or stiffness <= 0.0:
        return 0.0
    bends = []
    for prepared in problem.fitted:
        r, torque = prepared.recording, prepared.where.start_torque_Nm
        deflected = r.first("motor_angle_rad") / prepared.where.ratio - r.first("load_angle_rad")
        deflected = deflected if "motor_angle_rad" in r else 0.0
        if torque is not None and abs(deflected) < 0.5 * width:
            noise = prepared.floors.get("torque_Nm", 0.0)
            bends.append((torque**2 - noise**2) / stiffness**2)
    variance = float(np.mean(bends)) if bends else 0.0
    return min(float(np.sqrt(3.0 * max(variance, 0.0))), 0.5 * width)


def write_prediction(model: FoundModel, test: InputRecording, path: Path) -> Path:
    """Predict and write a CSV."""
    return write_columns(path, model.predict(test))
