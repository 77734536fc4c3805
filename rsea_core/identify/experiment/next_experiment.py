"""The next experiment: which recording would tell two explanations apart soonest.

Each load and input of a menu is scaled to the rig's limits and simulated with both rivals; each
may then answer the other's prediction with the nominal parameters, to first order. What it can't
answer, over the floor of the readings, is the separation; the best is the one with the most of it
a minute of bench time. Source: T-optimal designs (Atkinson & Fedorov, Biometrika 62 (1975) 57)
with parameters projected out; docs/diagnosis.md 7.4.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import rsea_core.machine.quantities as q
from rsea_core.engines.fixed_step.replay import CHANNELS, Numbers, Replay
from rsea_core.errors import InputError, RseaError
from rsea_core.identify.experiment.input_shapes import ROW_s, Shape, shapes
from rsea_core.identify.experiment.rival_response import (
    RivalRun,
    answered,
    answers_of,
    field_of,
    free_parameters,
    unanswered,
)
from rsea_core.identify.locate.port_sensitivity import UNREPEATED_COUNTS
from rsea_core.machine.inputs import COMMANDS, Inputs, Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel

DECIDES = 3.0  # standard errors between the rivals
CLEAR = 10.0  # so many that no further sensor is worth mounting
EXTRA_MASS = 0.5  # of the load's own, hung at the same distance
REFINED, LOOKED_AT = 16, 3  # the first few are answered by more than first order
SCALINGS = 12  # tries to bring an input within the limits
OPTIONAL = ("current_A", "torque_Nm")


@dataclass(frozen=True, kw_only=True)
class Rival:
    """An explanation that can be simulated.

    Attributes
    ----------
    name : str
    numbers : callable
        (Replay) -> Numbers, the machine under that replay's command and load.
    """

    name: str
    numbers: Callable[[Replay], Numbers]

    @classmethod
    def of(cls, name: str, model: ActuatorModel) -> "Rival":
        """A model as a rival."""
        return cls(name=name, numbers=lambda replay: replay.numbers(model))


@dataclass(frozen=True, kw_only=True)
class BenchLimits:
    """What an experiment must stay within.

    Attributes
    ----------
    current_A, torque_Nm, load_angle_rad : float
        Largest current, spring torque and load angle.
    seconds : float
        Longest experiment.
    """

    current_A: float = np.inf
    torque_Nm: float = np.inf
    load_angle_rad: float = 1.2
    seconds: float = 90.0

    def __post_init__(self):
        for name in ("current_A", "torque_Nm", "load_angle_rad", "seconds"):
            if not getattr(self, name) > 0.0:
                raise InputError(f"limit {name} = {getattr(self, name)} must be above 0")


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One experiment of the menu, as predicted.

    Attributes
    ----------
    shape, load : str
        Names in the menus.
    amplitude : float
        Of the command.
    sensors : tuple of str
        Columns that it needs.
    separation : float
        Standard errors between the rivals, the loser's parameters answered.
    seconds : float
    """

    shape: str
    load: str
    amplitude: float
    sensors: tuple[str, ...]
    separation: float
    seconds: float

    @property
    def rate(self) -> float:
        """Squared separation a minute of bench time."""
        return 60.0 * self.separation**2 / self.seconds


@dataclass(frozen=True, kw_only=True)
class NextExperiment:
    """The recording to make next.

    Attributes
    ----------
    best : Trial
    menu : tuple of Trial
        All of it, best first.
    rivals : (str, str)
    columns : mapping of str to (n,) array
        `time_s` and the command, ready to run.
    load : Load
    extra_mass_kg : float
        To be hung on the load for this recording; 0 without.
    signal : str
        The reading that tells most.
    predicted : (2, n) array
        What the rivals predict of it, the second with the parameters that come nearest.
    sentence : str
    """

    best: Trial
    menu: tuple[Trial, ...]
    rivals: tuple[str, str]
    columns: Mapping[str, NDArray]
    load: Load
    extra_mass_kg: float
    signal: str
    predicted: NDArray
    sentence: str

    @property
    def decides(self) -> bool:
        """Whether the separation is enough to settle it."""
        return self.best.separation > DECIDES

    def recording_toml(self, file: str) -> str:
        """The `[[recording]]` table of the file contract."""
        lines = ["[[recording]]", f'file = "{file}"', 'role = "identification"']
        lines.append(f'load = "{self.load.kind}"')
        if self.load.kind == "contact":
            lines += [
                f"contact_stiffness_Nm_per_rad = {self.load.contact_stiffness_Nm_per_rad!r}",
                f"contact_angle_rad = {self.load.contact_angle_rad!r}",
                f"contact_damping_Nms_per_rad = {self.load.contact_damping_Nms_per_rad!r}",
            ]
        description = shapes()[self.best.shape].description
        mass = f", {self.extra_mass_kg:.3g} kg added" if self.extra_mass_kg else ""
        return "\n".join([*lines, f'description = "{description}{mass}"']) + "\n"


def next_experiment(
    rig: Rig,
    rivals: tuple[Rival, Rival],
    *,
    sensors: Sequence[str],
    command: str,
    limits: BenchLimits,
    contact: Load | None = None,
    optional: Sequence[str] = OPTIONAL,
    inputs: Sequence[str] | None = None,
) -> NextExperiment:
    """The experiment that separates two rivals most per minute.

    Parameters
    ----------
    sensors : sequence of str
        Columns that the bench reads anyway.
    command : str
        The column that drives it.
    contact : Load or None
        A contact that the bench has.
    optional : sequence of str
        Sensors that could be added; they are asked for only where the bench's own do not decide.
    inputs : sequence of str or None
        Names of `excitation_inputs.shapes` that the bench can play; None: all.

    Raises
    ------
    InputError
        If the rig has no drive to excite it, or no experiment of the menu can be simulated.
    """
    if not rig.has("drive") or command not in COMMANDS:
        raise InputError(f"rig {rig.name!r}: {command} drives no experiment")
    trials, kept = [], {}
    for load_name, load in _loads(rig, contact).items():
        for shape_name, shape in shapes().items():
            if shape.seconds > limits.seconds or (inputs is not None and shape_name not in inputs):
                continue
            run = _scaled(rig, rivals, shape, load_name, load, command, limits)
            if run is None:
                continue
            for columns in _sensor_sets(sensors, optional):
                readable = tuple(c for c in columns if _is_read(c, load, run.replay))
                if not readable:
                    continue
                weights = _weights(rig, readable)
                separation = float(min(unanswered(run, side, weights)[0] for side in (0, 1)))
                trials.append(
                    Trial(
                        shape=shape_name, load=load_name, amplitude=run.amplitude,
                        sensors=readable, separation=separation, seconds=shape.seconds,
                    )
                )  # fmt: skip
                kept[load_name, shape_name] = (run, load)
    if not trials:
        raise InputError(f"rig {rig.name!r}: no experiment of the menu stays within the limits")
    menu = tuple(_refined(rig, trials, kept))
    clear = [t for t in menu if t.separation > CLEAR and set(t.sensors) <= set(sensors)]
    return _described(rig, clear[0] if clear else menu[0], menu, kept, rivals, command)


def _refined(
    rig: Rig, trials: list[Trial], kept: Mapping[tuple[str, str], tuple[RivalRun, Load]]
) -> list[Trial]:
    """The trials in their order, the first few answered by more than first order."""
    done: set[tuple] = set()
    for _ in range(REFINED):
        trials = sorted(trials, key=_order)
        rough = [t for t in trials[:LOOKED_AT] if (t.load, t.shape, t.sensors) not in done]
        if not rough:
            break
        trial = rough[0]
        run, _load = kept[trial.load, trial.shape]
        weights = _weights(rig, trial.sensors)
        sides = [answered(run, side, weights)[0] for side in (0, 1)]
        trials[trials.index(trial)] = replace(trial, separation=min(sides))
        done.add((trial.load, trial.shape, trial.sensors))
    return sorted(trials, key=_order)


def _order(trial: Trial) -> tuple[float, int]:
    return -trial.rate, len(trial.sensors)


def _loads(rig: Rig, contact: Load | None) -> dict[str, Load]:
    found = {}
    if rig.has("spring"):
        found["locked"] = Load(kind="locked")
    if rig.has("load"):
        hangs = rig.load_mass_kg is not None and rig.load_distance_m is not None
        found["pendulum" if hangs else "free"] = Load(kind="pendulum" if hangs else "free")
        if hangs and rig.load_mass_kg > 0.0 and rig.load_distance_m > 0.0:
            found["pendulum with added mass"] = Load(kind="pendulum")
        if contact is not None:
            found["contact"] = contact
    elif not rig.has("spring"):
        found["free"] = Load(kind="free")
    return found


def _scaled(
    rig: Rig,
    rivals: tuple[Rival, Rival],
    shape: Shape,
    load_name: str,
    load: Load,
    command: str,
    limits: BenchLimits,
) -> RivalRun | None:
    """The largest amplitude at which both rivals stay within the limits, and its runs."""
    time = np.arange(shape.value.size) * ROW_s
    full = {"duty": 1.0, "voltage_V": rig.supply_voltage_V or 24.0}.get(command)
    if full is None:
        most = min(limits.current_A, rig.current_limit_A or np.inf)
        full = most if np.isfinite(most) else 5.0
        full *= (rig.torque_constant_Nm_per_A or 1.0) if command == "motor_torque_Nm" else 1.0
    share = 1.0
    for _ in range(SCALINGS):
        values = share * full * shape.value
        replay = Replay.of(Inputs(time_s=time, load=load, **{command: values}))
        try:
            numbers = [_with_mass(rig, r.numbers(replay), load_name) for r in rivals]
            outputs = replay.run_many(numbers)
        except RseaError:
            return None
        room = _room(outputs, limits)
        if room < 1.0:
            share *= 0.97 * max(room, 0.1)
            continue
        answers = tuple(
            answers_of(replay, n, y, np.zeros(len(free_parameters(n))))
            for n, y in zip(numbers, outputs, strict=True)
        )
        return RivalRun(
            amplitude=float(share * full), replay=replay, command=values, numbers=tuple(numbers),
            outputs=(outputs[0], outputs[1]), answers=answers,
        )  # fmt: skip
    return None


def _with_mass(rig: Rig, numbers: Numbers, load_name: str) -> Numbers:
    if load_name != "pendulum with added mass":
        return numbers
    mass = EXTRA_MASS * rig.load_mass_kg
    gravity = numbers.plant[field_of("gravity")] * (1.0 + EXTRA_MASS)
    inertia = numbers.plant[field_of("load_inertia")] + mass * rig.load_distance_m**2
    return numbers.with_plant(gravity=gravity, load_inertia=inertia)


def _room(outputs: NDArray, limits: BenchLimits) -> float:
    """The smallest limit over what was reached, 0 where a simulation failed."""
    if not np.all(np.isfinite(outputs)):
        return 0.0

    def room(name: str, limit: float) -> float:
        reached = float(np.abs(outputs[:, :, CHANNELS.index(name)]).max())
        return limit / reached if reached > 0.0 else np.inf

    return min(
        room("current_A", limits.current_A),
        room("torque_Nm", limits.torque_Nm),
        room("load_angle_rad", limits.load_angle_rad),
    )


def _is_read(name: str, load: Load, replay: Replay) -> bool:
    if name not in CHANNELS:
        return False
    if name == "load_angle_rad" and load.is_held:
        return False
    return not (name == "current_A" and replay.command_name == "current_command_A")


def _sensor_sets(sensors: Sequence[str], optional: Sequence[str]) -> list[tuple[str, ...]]:
    """The bench's own sensors, then with each and with all that could be added."""
    own = tuple(sensors)
    more = [name for name in optional if name not in own]
    found = [own, *((*own, name) for name in more)]
    return [*found, (*own, *more)] if len(more) > 1 else found


def _weights(rig: Rig, columns: Sequence[str]) -> dict[int, float]:
    """One over the standard deviation of each reading, by channel."""
    found = {}
    for name in columns:
        if name == "motor_angle_rad":
            count = q.count_angle_rad(rig.motor_encoder_counts_per_rev or 8192)
            floor = np.hypot(count / np.sqrt(12.0), UNREPEATED_COUNTS * count)
        elif name == "load_angle_rad":
            floor = q.count_angle_rad(rig.load_encoder_counts_per_rev or 8192) / np.sqrt(12.0)
        elif name == "current_A":
            floor = rig.current_sensor_noise_A or 0.01
        elif name == "torque_Nm":
            floor = rig.torque_sensor_noise_Nm or 0.02
        else:
            continue
        found[CHANNELS.index(name)] = 1.0 / floor
    return found


def _described(
    rig: Rig,
    best: Trial,
    menu: tuple[Trial, ...],
    kept: Mapping[tuple[str, str], tuple[RivalRun, Load]],
    rivals: tuple[Rival, Rival],
    command: str,
) -> NextExperiment:
    run, load = kept[best.load, best.shape]
    weights = _weights(rig, best.sensors)
    loser = min((0, 1), key=lambda side: answered(run, side, weights)[0])
    _, output, squares = answered(run, loser, weights)
    channel = int(np.argmax(squares))
    names = (rivals[1 - loser].name, rivals[loser].name)
    predicted = np.stack([run.outputs[1 - loser][:, channel], output[:, channel]])
    mass = EXTRA_MASS * rig.load_mass_kg if best.load == "pendulum with added mass" else 0.0
    where = {
        "locked": "Clamp the output",
        "contact": "Let the load press against its stop",
        "pendulum with added mass": f"Hang {mass:.3g} kg more on the load",
    }.get(best.load, "Leave the load free to move")
    description = shapes()[best.shape].description
    sentence = (
        f"{where} and run {description}, {command} up to {best.amplitude:.3g},"
        f" {best.seconds:.0f} s, reading {', '.join(best.sensors)}: {names[0]} and {names[1]} then"
        f" differ by {best.separation:.3g} standard errors, most in {CHANNELS[channel]}."
    )
    columns = {"time_s": np.arange(run.command.size) * ROW_s, command: run.command}
    return NextExperiment(
        best=best, menu=menu, rivals=names, columns=columns, load=load, extra_mass_kg=mass,
        signal=CHANNELS[channel], predicted=predicted, sentence=sentence,
    )  # fmt: skip
