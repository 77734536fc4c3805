"""What a replay is given: commands, columns of rows, start states, windows; and their checks."""

from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

import rsea_core.machine.plant as mp
from rsea_core.engines.fixed_step.layout import (
    GEAR_SPEED,
    LINK_SPEED,
    LOAD_SPEED,
    N_STEP_STATES,
    OUTPUT_SPEED,
    Columns,
    Models,
)
from rsea_core.engines.fixed_step.packed_models import (
    Grid,
    Numbers,
    bench_numbers,
    model_numbers,
    packed_models,
)
from rsea_core.engines.fixed_step.rows import starts_at_rest
from rsea_core.errors import InputError
from rsea_core.machine.inputs import COMMANDS, Inputs, Load
from rsea_core.model.actuator_model import ActuatorModel

GEAR_RATIO = mp.Plant._fields.index("gear_ratio")


def known_command(name: str) -> str:
    """The name of a command column; `InputError` for another."""
    if name not in COMMANDS:
        raise InputError(f"command_name {name!r} is not one of {', '.join(COMMANDS)}")
    return name


def column(name: str, values: ArrayLike | None, n: int) -> NDArray:
    """Values (n,), finite; empty where there are none."""
    if values is None:
        return np.zeros(0)
    array = np.array(values, dtype=float)
    if array.shape != (n,):
        raise InputError(f"{name} has shape {array.shape}, time_s has {n} rows")
    if not np.all(np.isfinite(array)):
        raise InputError(f"{name}[{int(np.argmin(np.isfinite(array)))}] must be finite")
    return array


def start_states(values: ArrayLike, lead: tuple[int, ...]) -> NDArray:
    """Full states (*lead, N_STEP_STATES), finite; one state will do for a lead of one."""
    array = np.array(values, dtype=float)
    if array.ndim == 1 and lead == (1,):
        array = array[None]
    if array.shape != (*lead, N_STEP_STATES) or not np.all(np.isfinite(array)):
        raise InputError(
            f"start states of shape {array.shape} must be {(*lead, N_STEP_STATES)} finite numbers"
        )
    return array


def windows_of(windows: ArrayLike, rows: int) -> NDArray:
    """First and last rows (2, w) of windows (w, 2) within a recording."""
    first, last = found = np.atleast_2d(np.asarray(windows, dtype=np.int64)).T
    if np.any(first < 0) or np.any(last <= first) or np.any(last >= rows):
        raise InputError(f"windows must be rows first < last within 0..{rows - 1}")
    return found


def covering(windows: ArrayLike, rows: int) -> NDArray:
    """As `windows_of` windows that cover all rows, each once."""
    first, last = found = windows_of(windows, rows)
    if first[0] != 0 or last[-1] != rows - 1 or np.any(first[1:] != last[:-1] + 1):
        raise InputError(f"windows must cover rows 0..{rows - 1}, each once")
    return found


def cover(m: int, ends: NDArray, rows: int) -> NDArray:
    """`Jobs.rows` (m w, 4) of m models, one after the other, on windows (2, w) of all rows."""
    first, last = ends
    model, window = np.divmod(np.arange(m * first.size), first.size)
    at = model * rows + first[window]
    return np.stack([model, first[window], last[window], at], axis=1)


def _rate(angle: NDArray, time_s: NDArray) -> NDArray:
    if angle.size == 0:
        return angle
    return np.gradient(angle, time_s, edge_order=2 if angle.size > 2 else 1)


class ReplayInputs:
    """The inputs of one recording, ready for the fixed-step engine.

    Parameters
    ----------
    time_s : (n,) array
        Increasing; rows need not be even.
    command_name : str or None
        "duty", "voltage_V", "current_command_A", "motor_torque_Nm"; None without a drive.
    command : (n,) array or None
        Held from each row to the next.
    load : Load
    load_angle_rad : (n,) array or None
        Motion of an imposed load: a cubic between rows through central differences.
    spring_deflection_rad : (n,) array or None
        A spring bench: the deflection is given and `torque_Nm` is the response; `load` and
        `command` are left out.
    supply_V : (n,) array or None
        Measured supply, in place of the rig's where the command is a duty.
    drive_enabled : (n,) array or None
        1, or 0 while the bridge is open and no current flows.
    initial_angles_rad : (float, float)
        Motor and load angle at the start; a locked load stays at its own.
    initial_speeds_rad_per_s : (float, float)
        Motor and load speed at the start; a held load has none of its own.
    step_s : float or None
        Longest step; None takes `step_length.DEFAULT_STEP_s` or less where a fast mode needs it
        (then the largest number of steps that the models of a call need).

    Raises
    ------
    InputError
        If a column has another length than the time, or is not finite.
    """

    def __init__(
        self,
        *,
        time_s: ArrayLike,
        command_name: str | None = None,
        command: ArrayLike | None = None,
        load: Load = Load(),  # noqa: B008
        load_angle_rad: ArrayLike | None = None,
        spring_deflection_rad: ArrayLike | None = None,
        supply_V: ArrayLike | None = None,
        drive_enabled: ArrayLike | None = None,
        initial_angles_rad: tuple[float, float] = (0.0, 0.0),
        initial_speeds_rad_per_s: tuple[float, float] = (0.0, 0.0),
        step_s: float | None = None,
    ):
        self.is_bench = spring_deflection_rad is not None
        if self.is_bench:
            if command_name is not None or load_angle_rad is not None:
                raise InputError("spring_deflection_rad is given alone: no command, no load angle")
            load = Load(kind="locked")
        if (command_name is None) != (command is None):
            raise InputError("give command_name and command together")
        self._inputs = Inputs(
            time_s=time_s,
            load=load,
            load_angle_rad=load_angle_rad,
            initial_motor_angle_rad=initial_angles_rad[0],
            initial_load_angle_rad=initial_angles_rad[1],
            **({} if command_name is None else {known_command(command_name): command}),
        )
        self.load, self.command_name = load, command_name
        if not np.all(np.isfinite(initial_speeds_rad_per_s)):
            raise InputError(f"initial speeds {initial_speeds_rad_per_s} must be finite")
        self._speeds = initial_speeds_rad_per_s
        self.time_s = self._inputs.time_s
        n = self.time_s.size
        self.grid = Grid(self.time_s, step_s)
        supply = column("supply_V", supply_V, n)
        if supply.size and command_name != "duty":
            raise InputError("supply_V acts on a drive by duty only")
        gear = column("spring_deflection_rad", spring_deflection_rad, n)
        held = column("load_angle_rad", load_angle_rad, n)
        if self.is_bench:
            held = np.zeros(n)
        self.columns = Columns(
            time=np.array(self.time_s),
            steps=np.ones(n, np.int64),
            command=np.zeros(n) if command is None else np.array(command, dtype=float),
            supply=supply,
            enabled=column("drive_enabled", drive_enabled, n),
            load_angle=held,
            load_speed=_rate(held, self.time_s),
            gear_angle=gear,
            gear_speed=_rate(gear, self.time_s),
        )

    @classmethod
    def of(cls, inputs: Inputs, **more) -> Self:
        """The replay of an `Inputs`; `more` are what they do not hold."""
        name = inputs.command_name
        return cls(
            time_s=inputs.time_s,
            command_name=name,
            command=None if name is None else getattr(inputs, name),
            load=inputs.load,
            load_angle_rad=inputs.load_angle_rad,
            initial_angles_rad=(inputs.initial_motor_angle_rad, inputs.initial_load_angle_rad),
            **more,
        )

    @property
    def rows(self) -> int:
        """How many rows the recording has."""
        return self.time_s.size

    def numbers(self, model: ActuatorModel) -> Numbers:
        """What the engine reads of a model under this recording's command and load.

        Raises
        ------
        RigError, TermError, InputError
            As `ActuatorModel.plant` and `ActuatorModel.effects`.
        """
        if self.is_bench:
            return bench_numbers(model, self.load)
        return model_numbers(model, self.command_name, self.load)

    def at_rest(self, models: Models) -> NDArray:
        """Start states (m, N_STEP_STATES) of models at the initial angles and speeds."""
        starts = np.empty((len(models.plants), N_STEP_STATES))
        angles = self._inputs.initial_motor_angle_rad, self._inputs.initial_load_angle_rad
        starts_at_rest(models.plants, models.fx, angles[0], angles[1], starts)
        motor, load = self._speeds
        if motor != 0.0:
            starts[:, [GEAR_SPEED, OUTPUT_SPEED]] = motor / models.plants[:, [GEAR_RATIO]]
        if load != 0.0 and not self.load.is_held:
            starts[:, [LOAD_SPEED, LINK_SPEED]] = load
        return starts

    def start_state(self, numbers: Numbers | ActuatorModel) -> NDArray:
        """The full state (N_STEP_STATES,) of the machine at its initial angles and speeds."""
        return self.start_states([numbers])[0]

    def start_states(self, numbers: Sequence[Numbers | ActuatorModel]) -> NDArray:
        """The full states (m, N_STEP_STATES) of machines at their initial angles and speeds."""
        return self.at_rest(self._packed(numbers))

    def _as_numbers(self, given: Numbers | ActuatorModel) -> Numbers:
        return given if isinstance(given, Numbers) else self.numbers(given)

    def _packed(self, given: Sequence[Numbers | ActuatorModel]) -> Models:
        return packed_models([self._as_numbers(each) for each in given])
