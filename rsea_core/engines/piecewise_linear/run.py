"""Runs of the exact engine from Python: rows in, a log out."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

import rsea_core.engines.piecewise_linear.kernel as pk
from rsea_core.effects.sensor_reading import Sensors
from rsea_core.engines.piecewise_linear.machine import LinearMachine
from rsea_core.engines.piecewise_linear.modes import room


def is_even(time_s: NDArray) -> bool:
    """Whether rows (n,) are evenly spaced, as the exact engine needs them."""
    row_s = (time_s[-1] - time_s[0]) / (time_s.size - 1)
    return bool(np.all(np.abs(np.diff(time_s) - row_s) <= pk.UNEVEN * row_s))


def rows_of(
    machine: LinearMachine,
    time_s: NDArray,
    reference: NDArray,
    sensors: Sensors,
    *,
    start_rad: tuple[float, float],
    held: tuple[NDArray, NDArray] | None = None,
    rows_per_sample: int = 1,
    delay_samples: int = 0,
    command_limit: float = np.inf,
    noise: Sequence[float] = (0.0, 0.0, 0.0),
    seed: int = -1,
) -> pk.Rows:
    """The rows of a run.

    Parameters
    ----------
    reference : (n, 3) array
    start_rad : (float, float)
        Angle of the motor, on its own side, and of the load.
    held : ((n,), (n,)) arrays or None
        Angle and speed of a load whose motion is given.
    noise : (float, float, float)
        Standard deviations of the readings of motor angle, load angle and current.
    """
    plant, fx = machine.numbers.plant, machine.numbers.fx
    angle, speed = (np.zeros(0), np.zeros(0)) if held is None else held
    timed = (
        plant.current_limit < np.inf,
        plant.contact_angle < np.inf,
        fx[pk.e.WHEEL_DRY] != 0.0,
        fx[pk.e.LOAD_DRY] != 0.0,
    )
    return pk.Rows(
        start_s=float(time_s[0]),
        row_s=float(time_s[-1] - time_s[0]) / (time_s.size - 1),
        rows_per_sample=int(rows_per_sample),
        delay_samples=int(delay_samples),
        command_limit=float(command_limit),
        motor_noise_rad=float(noise[0]),
        load_noise_rad=float(noise[1]),
        current_noise_A=float(noise[2]),
        seed=int(seed),
        wheel_start_rad=float(start_rad[0]) / plant.gear_ratio,
        load_start_rad=float(start_rad[1] if held is None else angle[0]),
        time=np.array(time_s, dtype=float),
        reference=np.array(reference, dtype=float, order="C"),
        angle=np.array(angle, dtype=float),
        speed=np.array(speed, dtype=float),
        timed=np.array(timed),
        behind=machine.behind,
        sensors=sensors,
    )


class Runner:
    """Runs one machine again and again, its matrices made once; for one thread at a time."""

    def __init__(self, machine: LinearMachine, rows: pk.Rows):
        self._machine = machine.numbers
        self._modes, self._work = room(machine.numbers, rows.row_s)
        self.log = np.zeros((pk.N_LOG + machine.behind.size, rows.time.size))

    def run(self, rows: pk.Rows, controller, parameters: NDArray, state: NDArray):
        """Fill `log`; (status, last row) of `events`. parameters (p,), state (s,) are copied."""
        return pk.run(
            self._machine, self._modes, self._work, rows, controller,
            np.array(parameters, dtype=float), np.array(state, dtype=float), self.log,
        )  # fmt: skip
