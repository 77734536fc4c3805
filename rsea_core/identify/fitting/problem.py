"""A case as a fitting problem: hypotheses in, innovations out.

A hypothesis is the nominal machine with free values and some laws. Its innovations are those of
the free-run replay of every recording, through the compiled engine and the whitener; unknowns are
in units in which a step of one is worth taking, nominal values in tolerances.
"""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import rsea_core.effects.layout as fx
import rsea_core.machine.plant as mp
from rsea_core.effects.variant import PLANT, Law, RunConditions, TrialMachine
from rsea_core.engines.fixed_step.replay import CHANNELS, Numbers, Replay
from rsea_core.errors import InputError, RecordingError, RigError
from rsea_core.identify.candidates.catalogue import known_laws, of_one_body
from rsea_core.identify.candidates.rig_parameters import Nominal, nominals, write_nominal
from rsea_core.identify.fitting.innovations import ReplayTask, replay_innovations
from rsea_core.identify.fitting.predictions import Windows, predict_readings, run_machines
from rsea_core.identify.fitting.replay_setup import prepare, start_std
from rsea_core.identify.smoothing.whitening import Whitener, block_rows, whitener
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import Case, noise_floor
from rsea_core.recordings.quality_checks import data_errors
from rsea_core.recordings.recording import Recording

HEAT_s = 0.1  # blocks over which the current's heat is averaged
READ_CURRENT = CHANNELS.index("current_A")
BLOCKS = 5  # of rows, that a recording needs at least
READ = ("motor_angle_rad", "load_angle_rad", "spring_deflection_rad", "current_A", "torque_Nm")


@dataclass(frozen=True, kw_only=True)
class PreparedRecording:
    """A recording, ready to be replayed and compared."""

    recording: Recording
    replay: Replay
    where: RunConditions
    base: Numbers
    channels: tuple[str, ...]
    floors: Mapping[str, float]
    whitener: Whitener
    measured: NDArray  # (rows, channels)
    windows: Windows | None = None  # None: one run over all rows

    def runs(self, machines: Sequence[TrialMachine]) -> NDArray:
        """Whole runs (m, rows, 7) of machines."""
        return run_machines(self.replay, machines, self.where)


@dataclass(frozen=True, kw_only=True)
class Hypothesis:
    """Laws on top of the nominal machine."""

    laws: tuple[Law, ...] = ()

    @property
    def key(self) -> str:
        """Unique name."""
        return " + ".join(law.key for law in self.laws) or "parameters only"

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects, each once."""
        return tuple(dict.fromkeys(law.effect for law in self.laws if not law.nuisance))

    @property
    def places(self) -> tuple[tuple[str, str | None, str | None], ...]:
        """Effect, column and recording of each law: the same for all laws of an effect."""
        return tuple((law.effect, law.sensor, law.only) for law in self.laws)


class Problem:
    """The prepared recordings of a case, what is free, and the `nominal` machine of its file.

    Parameters
    ----------
    step_s : float or None
        Longest step of the replays.
    """

    def __init__(self, case: Case, *, step_s: float | None = None):
        self.case, self.step_s = case, step_s
        self.nominals: tuple[Nominal, ...] = nominals(case)
        self.base = {n.key: n.value for n in self.nominals}
        self.model = ActuatorModel(case.rig)
        self.nominal = Hypothesis(laws=known_laws(case))
        began, self.prepared = 0.0, []
        past: list[NDArray] = []
        ambient = None
        for index, r in enumerate(case.recordings):
            warm = 0.0
            if "temperature_C" in r:
                first = float(np.mean(r["temperature_C"][: max(5, r.rows // 200)]))
                ambient = first if ambient is None else ambient
                warm = max(first - ambient, 0.0)
            where = RunConditions(
                index=index, file=r.file, kind=r.load.kind, ratio=case.rig.gear_ratio or 1.0,
                session_s=began, case_rise_K=warm, time_s=r.time_s,
                past=np.concatenate(past) if past else np.zeros((0, 2)),
                start_torque_Nm=float(r["torque_Nm"][0]) if "torque_Nm" in r else None,
            )  # fmt: skip
            began += float(r.time_s[-1] - r.time_s[0])
            try:
                prepared = self._prepared(r, where)
            except (RigError, InputError) as problem:
                raise type(problem)(f"{r.file}: {problem}") from problem
            self.prepared.append(prepared)
            past += [_heating(prepared), np.array([[-1.0, 0.0]])]
        self.fitted = [b for b in self.prepared if b.recording.role == "identification"]
        self.heat = np.concatenate(past[:-1])  # of the whole session, as `initial_rises`

    def _prepared(self, r: Recording, where: RunConditions) -> PreparedRecording:
        replay, base = prepare(self.model, r, step_s=self.step_s)
        floors = noise_floor(self.case.rig, r)
        channels = tuple(
            name for name in READ if name in r.responses and _is_predicted(name, r, replay)
        )
        require_comparable(r, channels)
        plant = machine_of(base)
        starts = {} if r.initial_rest else {"start_std": start_std(r, plant.gear_ratio, floors)}
        return PreparedRecording(
            recording=r,
            replay=replay,
            where=where,
            base=base,
            channels=channels,
            floors={name: floors[name] for name in channels},
            whitener=self._whitener(r, plant, channels, floors, **starts),
            measured=np.stack([r[name] for name in channels], axis=1),
        )

    def _whitener(self, r: Recording, plant: mp.Plant, channels, floors, **starts) -> Whitener:
        return whitener(
            plant, self.case.rig.spring_stiffness_Nm_per_rad or 0.0, channels=channels,
            floors=floors, row_s=r.sample_time_s, rows=r.rows, **observed(plant, r), **starts,
        )  # fmt: skip

    def with_fitted(self, recordings: Sequence[PreparedRecording]) -> "Problem":
        """The same problem on other readings of the fitted recordings."""
        other = copy(self)
        other.fitted = list(recordings)
        return other

    def in_windows(
        self, prepared: PreparedRecording, windows: Windows, start_std: NDArray
    ) -> PreparedRecording:
        """The recording replayed in windows that begin at the smoothed motion.

        Parameters
        ----------
        start_std : (5,) array
            Standard deviations of a window's start, as `Windows.motion`.
        """
        begins = np.zeros(prepared.whitener.blocks, bool)
        at = windows.rows[:, 0] // prepared.whitener.block
        begins[at[at < begins.size]] = True
        filtered = self._whitener(
            prepared.recording, machine_of(prepared.base), prepared.channels, dict(prepared.floors),
            begins=begins, start_std=start_std,
        )  # fmt: skip
        return replace(prepared, windows=windows, whitener=filtered)

    # ---- unknowns

    def start(self, hypothesis: Hypothesis, values: Sequence[Sequence[float]] = ()) -> NDArray:
        """Unknowns at the rig's nominal values and given (or first) values of each law."""
        x = [np.zeros(len(self.nominals))]
        for j, law in enumerate(hypothesis.laws):
            given = values[j] if j < len(values) else law.starts[0]
            x.append(_to_x(law, given))
        return np.concatenate(x)

    def bounds(self, hypothesis: Hypothesis) -> tuple[NDArray, NDArray]:
        """Lowest and highest unknowns."""
        low, high = [-12.0] * len(self.nominals), [12.0] * len(self.nominals)
        for law in hypothesis.laws:
            for parameter in law.unknowns:
                if parameter.scale > 0.0:
                    a, b = parameter.low, parameter.high
                    if parameter.log:
                        a, b = np.log(a), np.log(b)
                    low.append(a / parameter.scale)
                    high.append(b / parameter.scale)
        return np.array(low), np.array(high)

    def prior(self, hypothesis: Hypothesis) -> tuple[NDArray, NDArray]:
        """Centre and weight (1/standard deviation, 0 without prior) of each unknown."""
        n = len(self.nominals)
        centre, weight = [0.0] * n, [1.0] * n
        for law in hypothesis.laws:
            for parameter, first in zip(law.unknowns, law.starts[0], strict=True):
                if parameter.scale > 0.0:
                    middle = np.log(first) if parameter.log else 0.0
                    centre.append(middle / parameter.scale)
                    weight.append(
                        0.0 if parameter.prior is None else parameter.scale / parameter.prior
                    )
        return np.array(centre), np.array(weight)

    def values(self, hypothesis: Hypothesis, x: NDArray) -> tuple[dict, list[dict]]:
        """Nominal values by key, and each law's values by name."""
        n = len(self.nominals)
        nominal = {p.key: p.at(v) for p, v in zip(self.nominals, x[:n], strict=True)}
        found, at = [], n
        for law in hypothesis.laws:
            numbers, first = [], law.starts[0]
            for parameter, fixed in zip(law.unknowns, first, strict=True):
                if parameter.scale > 0.0:
                    v = x[at] * parameter.scale
                    numbers.append(np.exp(v) if parameter.log else v)
                    at += 1
                else:
                    numbers.append(fixed)
            found.append(law.values(np.array(numbers)))
        return nominal, found

    def names(self, hypothesis: Hypothesis) -> list[str]:
        """Names of the unknowns."""
        own = [n.key for n in self.nominals]
        for law in hypothesis.laws:
            own += [
                f"{law.effect}.{parameter.name}"
                for parameter in law.unknowns
                if parameter.scale > 0.0
            ]
        return own

    # ---- predictions

    def predict(self, prepared: PreparedRecording, hypothesis: Hypothesis, X: NDArray) -> NDArray:
        """Readings (m, rows, channels) of a recording for unknowns (m, n); NaN where it failed."""
        machines = [self.trial_machine(prepared, hypothesis, x) for x in X]
        return predict_readings(
            prepared.replay, machines, prepared.channels, prepared.where, prepared.windows
        )

    def trial_machine(
        self, prepared: PreparedRecording, hypothesis: Hypothesis, x: NDArray
    ) -> TrialMachine:
        """The machine's numbers on one recording for given unknowns."""
        nominal, laws = self.values(hypothesis, x)
        machine = TrialMachine(
            plant=prepared.base.plant.copy(),
            fx=np.zeros(fx.N_EFFECTS),
            stiffness=self.case.rig.spring_stiffness_Nm_per_rad or 0.0,
        )
        write_nominal(nominal, self.base, machine, self.case.rig)
        for law, values in zip(hypothesis.laws, laws, strict=True):
            if self.acts(law, hypothesis):
                law.write(values, machine, prepared.where)
        return machine

    def acts(self, law: Law, hypothesis: Hypothesis) -> bool:
        """Whether a law acts: a found one takes the place of the same effect as it was stated."""
        if not law.known:
            return True
        found, body = set(hypothesis.effects), of_one_body(self.case.rig)
        found |= {w.kind.generalises for w in hypothesis.laws if w.kind and not w.nuisance}
        return law.effect not in (found | body if found & body else found)

    def innovations(
        self,
        hypothesis: Hypothesis,
        X: NDArray,
        recordings: Sequence[PreparedRecording] | None = None,
    ) -> list[NDArray]:
        """Innovations of each recording: (m, blocks, channels), NaN where a replay failed."""
        return self.innovations_of([(hypothesis, x) for x in X], recordings)

    def innovations_of(
        self,
        trials: Sequence[tuple[Hypothesis, NDArray]],
        recordings: Sequence[PreparedRecording] | None = None,
    ) -> list[NDArray]:
        """As `innovations`, of unknowns of different hypotheses, replayed together."""
        return replay_innovations(
            [
                ReplayTask(
                    replay=prepared.replay, where=prepared.where, windows=prepared.windows,
                    measured=prepared.measured, whitener=prepared.whitener,
                    machines=[self.trial_machine(prepared, h, x) for h, x in trials],
                )
                for prepared in (self.fitted if recordings is None else recordings)
            ]
        )  # fmt: skip


def require_comparable(r: Recording, channels: tuple[str, ...]) -> None:
    """Refuse what no replay can be compared with."""
    if not channels:
        raise RecordingError(
            f"{r.file}: no column that a replay predicts: needs one of {', '.join(READ)} that is"
            " neither the input nor imposed (a logged velocity is its drive's filter, not a state)"
        )
    least = BLOCKS * block_rows(r.sample_time_s)
    if r.rows < least:
        raise RecordingError(
            f"{r.file}: too short: {r.rows} rows in {r.time_s[-1] - r.time_s[0]:.3g} s; a replay"
            f" needs at least {least} such rows to be compared"
        )


def require_replays(problem: Problem, msni: NDArray) -> None:
    """Refuse a rig whose machine leaves the range of numbers where recordings begin a search.

    Parameters
    ----------
    msni : (recordings,) array
        Mean square innovations at the rig's values.

    Raises
    ------
    RecordingError
        Naming the recordings, and what contradicts the rig file first.
    """
    failed = [
        b.recording.file for b, p in zip(problem.fitted, msni, strict=True) if not np.isfinite(p)
    ]
    if failed:
        errors = data_errors(problem.case)
        hint = f"; {errors[0].sentence()}" if errors else ""
        raise RecordingError(
            f"the machine of rig.toml, replayed with {', '.join(failed[:3])}, leaves the range of"
            f" numbers: is a value of rig.toml out by orders of magnitude?{hint}"
        )


def _heating(prepared: PreparedRecording) -> NDArray:
    """Blocks of time [s] and mean squared currents [A^2]: read, commanded, or of the rig."""
    r = prepared.recording
    if "current_A" in r:
        current = r["current_A"]
    elif r.command_name == "current_command_A":
        limit = machine_of(prepared.base).current_limit
        current = np.clip(r[r.command_name], -limit, limit)
    elif r.command_name in ("duty", "voltage_V"):
        current = prepared.replay.run_many([prepared.base], failures="nan")[0, :, READ_CURRENT]
        current = np.nan_to_num(current)
    else:
        return np.zeros((0, 2))
    rows = max(round(HEAT_s / r.sample_time_s), 1)
    first = np.arange(0, r.rows, rows)
    lengths = np.diff(np.append(first, r.rows))
    return np.stack(
        [lengths * r.sample_time_s, np.add.reduceat(current**2, first) / lengths], axis=1
    )


def _is_predicted(name: str, r: Recording, replay: Replay) -> bool:
    if name == "current_A":
        return r.command_name in ("duty", "voltage_V")
    if name == "spring_deflection_rad":
        return not replay.is_bench
    return not (name == "load_angle_rad" and r.load.kind == "imposed")


def observed(plant: mp.Plant, r: Recording) -> dict:
    """What models of a replay's errors take from a recording: contact, motion, the drive."""
    contact = np.zeros(r.rows, dtype=bool)
    if np.isfinite(plant.contact_angle) and "load_angle_rad" in r:
        contact = r["load_angle_rad"] > plant.contact_angle
    motion = np.std(r["motor_angle_rad"]) if "motor_angle_rad" in r else 0.0
    if motion == 0.0 and "load_angle_rad" in r:
        motion = np.std(r["load_angle_rad"]) * plant.gear_ratio
    return {"in_contact": contact, "motion": float(motion), "drive": _given(plant, r)}


def _given(plant: mp.Plant, r: Recording) -> NDArray:
    """Volts at the winding, or the drive's torque on the wheel."""
    if r.command_name is None:
        return np.zeros(r.rows)
    per = {
        mp.DUTY: plant.volts_per_command,
        mp.VOLTAGE: 1.0,
        mp.CURRENT: plant.torque_per_ampere,
        mp.MOTOR_TORQUE: plant.torque_per_motor_torque,
        mp.POSITION: plant.volts_per_command,
    }
    return per.get(plant.drive, 0.0) * r[r.command_name]


def machine_of(numbers: Numbers) -> mp.Plant:
    """The machine of bare numbers."""
    values = list(numbers.plant)
    values[PLANT["drive"]], values[PLANT["structure"]] = int(values[0]), int(values[1])
    return mp.Plant(*values)


def _to_x(law: Law, values: Sequence[float]) -> NDArray:
    found = []
    for parameter, value in zip(law.unknowns, values, strict=True):
        if parameter.scale > 0.0:
            found.append((np.log(value) if parameter.log else value) / parameter.scale)
    return np.array(found)
