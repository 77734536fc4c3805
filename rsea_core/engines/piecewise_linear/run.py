"""Runs of the exact engine from Python: rows in, a log out."""

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

import rsea_core.engines.piecewise_linear.events as pe
import rsea_core.engines.piecewise_linear.kernel as pk
from rsea_core.effects.sensor_reading import Sensors
from rsea_core.engines.piecewise_linear.machine import LinearMachine
from rsea_core.engines.piecewise_linear.modes import Modes, Work, room

NOT_HERE = {
    pe.NOT_EVEN: "its rows are not evenly spaced",
    pe.TOO_STIFF: "a mode is too fast for its rows",
}
"""Why rows do not allow the exact engine, by its status."""
NOT_HELD = np.zeros(0)  # a motion of the load that is not given


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
    angle, speed = (NOT_HELD, NOT_HELD) if held is None else map(np.array, held)
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
        wheel_start_rad=float(start_rad[0]) / machine.numbers.plant.gear_ratio,
        load_start_rad=float(start_rad[1] if held is None else angle[0]),
        time=np.require(time_s, float, ("C", "W")),  # copied where it is read-only
        reference=np.require(reference, float, ("C", "W")),
        angle=angle,
        speed=speed,
        timed=machine.timed,
        behind=machine.behind,
        sensors=sensors,
    )


_ROOMS = threading.local()
ROOMS_KEPT = 4  # of a thread


@contextmanager
def _room(machine: LinearMachine, row_s: float) -> Iterator[tuple[Modes, Work]]:
    """Memory of one run, with the matrices that earlier runs of this thread made."""
    rooms: list = _ROOMS.__dict__.setdefault("idle", [])
    known = (i for i, (of, modes, _) in enumerate(rooms) if of is machine and modes.row_s == row_s)
    at = next(known, None)
    mine = (machine, *room(machine.numbers, row_s)) if at is None else rooms.pop(at)
    yield mine[1:]
    rooms.append(mine)
    del rooms[:-ROOMS_KEPT]


class Runner:
    """Runs one machine again and again into one log; for one thread at a time."""

    def __init__(self, machine: LinearMachine, rows: pk.Rows):
        self._machine = machine
        self.log = np.empty((pk.N_LOG + machine.behind.size, rows.time.size))

    def run(self, rows: pk.Rows, controller, parameters: NDArray, state: NDArray):
        """Fill `log` by a compiled controller: (status, last row) of `events`.

        parameters (p,) and state (s,) are copied.
        """
        with _room(self._machine, rows.row_s) as (modes, work):
            return pk.run(
                self._machine.numbers, modes, work, rows, controller.address,
                np.array(parameters, dtype=float), np.array(state, dtype=float), self.log,
            )  # fmt: skip
