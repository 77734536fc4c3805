"""The exact propagator: the fast way through machines that are linear between events.

Where the spring is a chain of straight lines and friction is Coulomb's or a worm's, with the
nominal contact, current limit and held commands, a machine is linear until something switches.
Its motion over a row is then one product with a matrix exponential (`propagator_modes`).
`obstacle` says whether a machine is of that kind, `propagate` and `propagate_closed_loop` run
it. The result has no energy ledger: those integrals are what `simulate` costs its time for.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

import rsea_core.effects.layout as e
import rsea_core.engines.event_driven.states as k
import rsea_core.engines.piecewise_linear.events as pe
import rsea_core.engines.piecewise_linear.kernel as pk
import rsea_core.machine.plant as mp
import rsea_core.machine.quantities as q
from rsea_core.effects.registry import Port
from rsea_core.engines.event_driven.open_loop import playback
from rsea_core.errors import InputError, SimulationError
from rsea_core.files.csv_columns import write_columns
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.machine.spring_table import ANCHOR, C0, C1, C2, UPPER, SpringTable
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.numeric.arrays import read_only

ALLOWED = frozenset(
    (
        "any",
        "wheel_dry",
        "gear_coulomb_forward",
        "gear_coulomb_backward",
        "gear_stribeck_velocity",
        "gear_drive_loss",
        "gear_backdrive_loss",
        "load_dry",
        "load_coulomb",
        "load_stribeck_velocity",
        "pulse_torque",
        "pulse_start",
        "pulse_end",
        "parallel_stiffness",
        "parallel_rest_angle",
        "dead_zone",
    )
)
"""The numbers of `effects` that leave a machine linear between events."""
TIMES = ("current_limited_s", "contact_s", "wheel_stuck_s", "load_stuck_s")


@dataclass(frozen=True, kw_only=True)
class Propagation:
    """What a machine does, row by row; (n,) read-only arrays, names and meaning of `Trajectory`.

    Attributes
    ----------
    current_limited_s, contact_s, wheel_stuck_s, load_stuck_s : array
        Time spent so far at the current limit, in contact, and held by dry friction.
    """

    model: ActuatorModel
    load: Load
    command_name: str | None
    time_s: NDArray
    command: NDArray
    unsaturated_command: NDArray
    wheel_angle_rad: NDArray
    wheel_velocity_rad_per_s: NDArray
    load_angle_rad: NDArray
    load_velocity_rad_per_s: NDArray
    current_A: NDArray
    torque_Nm: NDArray
    current_limited_s: NDArray
    contact_s: NDArray
    wheel_stuck_s: NDArray
    load_stuck_s: NDArray
    reference: NDArray | None
    reference_name: str | None

    @property
    def _ratio(self) -> float:
        return self.model.rig.gear_ratio if self.model.rig.has("gear") else 1.0

    @property
    def motor_angle_rad(self) -> NDArray:
        """Motor side."""
        return q.motion_to_motor(self.wheel_angle_rad, self._ratio)

    @property
    def motor_velocity_rad_per_s(self) -> NDArray:
        """Motor side."""
        return q.motion_to_motor(self.wheel_velocity_rad_per_s, self._ratio)

    @property
    def encoder_motor_angle_rad(self) -> NDArray:
        """Readings in whole encoder counts."""
        return _counted(self.motor_angle_rad, self.model.rig.motor_encoder_counts_per_rev)

    @property
    def encoder_load_angle_rad(self) -> NDArray:
        """Readings in whole encoder counts."""
        return _counted(self.load_angle_rad, self.model.rig.load_encoder_counts_per_rev)

    @property
    def spring_deflection_rad(self) -> NDArray:
        """Wheel angle less load angle."""
        return self.wheel_angle_rad - self.load_angle_rad

    def columns(self) -> Mapping[str, NDArray]:
        """Every column by name: those of a recording, then what only a simulation knows."""
        found = {"time_s": self.time_s}
        if self.command_name is not None:
            found[self.command_name] = self.command
        if self.reference is not None:
            found[self.reference_name] = self.reference
        names = (
            "motor_angle_rad", "motor_velocity_rad_per_s", "load_angle_rad",
            "load_velocity_rad_per_s", "spring_deflection_rad", "current_A", "torque_Nm",
            "encoder_motor_angle_rad", "encoder_load_angle_rad", "current_limited_s",
            "contact_s", "wheel_stuck_s", "load_stuck_s",
        )  # fmt: skip
        return found | {name: getattr(self, name) for name in names}

    def to_csv(self, path: str | Path) -> Path:
        """Write all columns; the file appears whole or not at all."""
        return write_columns(path, self.columns())


@dataclass(frozen=True, kw_only=True)
class LinearMachine:
    """A machine ready for the propagator: its numbers, made once for any number of runs.

    Attributes
    ----------
    plant : kernel.Plant
    regions : (r, 6) array
        The spring's straight lines, neighbours of one line merged.
    effects : (N_EFFECTS,) array
    """

    model: ActuatorModel
    load: Load
    command_name: str | None
    plant: mp.Plant
    regions: NDArray
    effects: NDArray

    @classmethod
    def of(cls, model: ActuatorModel, command_name: str | None, load: Load) -> "LinearMachine":
        """The machine of a model.

        Raises
        ------
        SimulationError
            If the model is not linear between events; the message names what is not.
        RigError, TermError
            As `simulate`.
        """
        plant, spring = model.plant(command_name, load), model.spring_table(load)
        effects = model.effects(command_name, load)
        problem = _obstacle(plant, spring, effects) or _misread(model)
        if problem is not None:
            raise SimulationError(f"the exact propagator cannot run this model: {problem}")
        return cls(
            model=model,
            load=load,
            command_name=command_name,
            plant=plant,
            regions=_lines(spring),
            effects=effects,
        )


def obstacle(model: ActuatorModel, load: Load, command_name: str | None = "duty") -> str | None:
    """Why the propagator cannot run a model, None where it can.

    Raises
    ------
    RigError, TermError
        If the model cannot be simulated at all.
    """
    plant, spring = model.plant(command_name, load), model.spring_table(load)
    linear = _obstacle(plant, spring, model.effects(command_name, load))
    return linear or _misread(model)


def can_propagate(model: ActuatorModel, load: Load, command_name: str | None = "duty") -> bool:
    """Whether a model is linear between events, so that the propagator runs it.

    Raises
    ------
    RigError, TermError
        If the model cannot be simulated at all.
    """
    return obstacle(model, load, command_name) is None


def propagate(model: ActuatorModel, inputs: Inputs) -> Propagation:
    """What a machine does under given inputs, by the exact propagator.

    Raises
    ------
    SimulationError
        If the model is not linear between events, or its states leave the range of numbers.
    InputError
        If the rows are not evenly spaced.
    """
    reference = np.zeros((inputs.time_s.size, 3))
    if inputs.command_name is not None:
        reference[:, 0] = getattr(inputs, inputs.command_name)
    return propagate_sampled(
        LinearMachine.of(model, inputs.command_name, inputs.load),
        time_s=inputs.time_s,
        controller=playback(),
        parameters=np.zeros(1),
        state=np.zeros(1),
        reference=reference,
        load_angle_rad=inputs.load_angle_rad,
        initial_angles_rad=(inputs.initial_motor_angle_rad, inputs.initial_load_angle_rad),
    )


def propagate_sampled(
    machine: LinearMachine,
    *,
    time_s: NDArray,
    controller,
    parameters: NDArray,
    state: NDArray,
    reference: NDArray,
    load_angle_rad: ArrayLike | None = None,
    initial_angles_rad: tuple[float, float] = (0.0, 0.0),
    rows_per_sample: int = 1,
    delay_samples: int = 0,
    command_limit: float = np.inf,
    reference_name: str | None = None,
) -> Propagation:
    """Run a compiled controller (`kernel.CONTROLLER`) on a machine; as `simulate.run_sampled`.

    Raises
    ------
    InputError
        If the rows are not evenly spaced.
    SimulationError
        If the states leave the range of numbers, or a mode is too fast for the rows.
    """
    plant, time = machine.plant, read_only(np.array(time_s, dtype=float))
    grid = pk.Grid(
        start_s=float(time_s[0]),
        row_s=float(time_s[-1] - time_s[0]) / (time_s.size - 1),
        rows_per_sample=rows_per_sample,
        delay_samples=delay_samples,
        command_limit=float(command_limit),
    )
    load_start, held, speed = initial_angles_rad[1], np.zeros(0), np.zeros(0)
    if load_angle_rad is not None:
        held = np.array(load_angle_rad, dtype=float)
        speed = np.gradient(held, time_s, edge_order=2 if held.size > 2 else 1)
        load_start = held[0]
    log, fx = np.empty((pk.N_LOG, time_s.size)), machine.effects
    timed = np.array(
        (
            plant.current_limit < np.inf,
            plant.contact_angle < np.inf,
            fx[e.WHEEL_DRY] != 0.0,
            fx[e.LOAD_DRY] != 0.0,
        )
    )
    wheel_start = q.motion_to_output(initial_angles_rad[0], plant.gear_ratio)
    status, row = pk.run(
        plant,
        machine.regions,
        machine.effects,
        controller,
        np.array(parameters, dtype=float, ndmin=2),
        np.array(state, dtype=float, ndmin=2),
        grid,
        time,
        np.ascontiguousarray(reference),
        held,
        speed,
        (float(wheel_start), float(load_start)),
        timed,
        log,
        0,
        np.zeros((0, 5)),
        np.zeros((0, 0)),
    )
    require_done(status, float(time_s[row]))
    log.setflags(write=False)
    return Propagation(
        model=machine.model,
        load=machine.load,
        command_name=machine.command_name,
        time_s=time,
        command=log[pk.LOG_COMMAND],
        unsaturated_command=log[pk.LOG_UNSATURATED],
        wheel_angle_rad=log[k.TW],
        wheel_velocity_rad_per_s=log[k.WW],
        load_angle_rad=log[k.TL],
        load_velocity_rad_per_s=log[k.WL],
        current_A=log[k.IM],
        torque_Nm=log[pk.LOG_TORQUE],
        **{
            name: log[pk.LOG_TIMES + m] if timed[m] else read_only(np.zeros(time.size))
            for m, name in enumerate(TIMES)
        },
        reference=None if reference_name is None else read_only(np.array(reference[:, 0])),
        reference_name=reference_name,
    )


def require_done(status: int, time_s: float) -> None:
    """Raise what a run's status says.

    Raises
    ------
    InputError, SimulationError
        Unless the run is done.
    """
    if status == pe.NOT_EVEN:
        raise InputError(
            f"the exact propagator needs evenly spaced rows; the one after {time_s:.9g} s is not:"
            " use simulate, or resample"
        )
    if status == pe.NOT_FINITE:
        raise SimulationError(
            f"the states left the range of numbers at t = {time_s:.6g} s: is the loop unstable,"
            " or a value out by orders of magnitude?"
        )
    if status == pe.TOO_MANY_SWITCHES:
        raise SimulationError(
            f"more than {pe.MAX_SWITCHES_PER_ROW} switches of current limit, contact, friction or"
            f" spring within the row at t = {time_s:.6g} s: shorten the rows"
        )
    if status == pe.TOO_STIFF:
        raise SimulationError(
            f"a mode met at t = {time_s:.6g} s is more than 10 million times faster than a row:"
            " leave a negligible terminal_inductance_H out, or check inertias and stiffnesses"
        )


def _misread(model: ActuatorModel) -> str | None:
    sensors = [term.key for term in model.terms if term.port is Port.SENSOR]
    return f"its sensors do not show the truth: {', '.join(sensors)}" if sensors else None


def _counted(angle_rad: NDArray, counts_per_rev: float | None) -> NDArray:
    if counts_per_rev is None:
        return angle_rad
    count = q.count_angle_rad(counts_per_rev)
    return np.floor(angle_rad / count) * count


def _obstacle(plant: mp.Plant, spring: SpringTable, effects: NDArray) -> str | None:
    if np.any(spring.regions[:, C2:] != 0.0):
        return "its spring is no chain of straight lines"
    present = [e.EFFECTS[index] for index in np.flatnonzero(effects)]
    curved = [name for name in present if name not in ALLOWED]
    if curved:
        return f"it is not linear in {', '.join(curved)}"
    if plant.structure == mp.RIGID_HELD and plant.gravity != 0.0:
        return "wheel and load are one held body"
    if plant.structure == mp.RIGID_FREE and np.any(
        effects[[e.GEAR_DRIVE_LOSS, e.GEAR_BACKDRIVE_LOSS]]
    ):
        return "its worm carries a rigid load"
    return None


def _lines(spring: SpringTable) -> NDArray:
    """The regions with neighbours of one line merged."""
    kept = [spring.regions[0]]
    for region in spring.regions[1:]:
        last = kept[-1]
        at_anchor = last[C0] + last[C1] * (region[ANCHOR] - last[ANCHOR])
        scale = abs(region[C0]) + abs(region[C1]) * 1e-3
        if region[C1] == last[C1] and abs(at_anchor - region[C0]) <= 1e-12 * scale:
            kept[-1] = np.concatenate(([region[UPPER]], last[ANCHOR:]))
        else:
            kept.append(region)
    return read_only(np.ascontiguousarray(kept))
