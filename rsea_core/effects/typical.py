"""What is typical of a machine's recordings, by which starts and steps of variants are scaled."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from rsea_core.machine.rig import Rig

# Typical of the motions of the bench whose limits and starts are absolute numbers.
BENCH_SPEED_rad_per_s, BENCH_ANGLE_rad, BENCH_TIME_s, BENCH_RATIO = 2.0, 0.5, 0.25, 60.0

RANGE = 3.0  # of a motion, in standard deviations
LEAST_CYCLES = 1.5
KNOWN_TO = 2.0  # recorded amplitudes: a spring's loop is known up to here by its law


@dataclass(frozen=True, kw_only=True)
class TypicalMagnitudes:
    """Typical magnitudes of a machine in its recordings.

    Attributes
    ----------
    torque_Nm : float
        Through the spring.
    stiffness : float
        Of the spring [Nm/rad].
    speed_rad_per_s : float
        Of the load.
    columns, loads : tuple of str
        Responses that were recorded, kinds of loads.
    rig : Rig or None
        None where values are read and not fitted.
    commands : frozenset of str
        What drives the recordings.
    peak_current_A : float or None
        The largest that was read, or else commanded.
    often_read_A : float or None
        The current below which 98 % of a recording's readings are, of the largest; None: not read.
    command : float
        Largest standard deviation of the command, in its own unit.
    relative : bool
        Whether starts and bounds follow the machine's own scales throughout, for any machine;
        else some are those of the bench.
    angle_rad, time_s : float
        Standard deviation of the load's angle in the fastest recording, and that over the speed.
    widest_angle_rad : float or None
        The same of the recording in which it is largest; None: `angle_rad`.
    begins_deflected : bool
        Whether a recording begins with a deflected spring.
    spans : mapping
        Standard deviation (of the largest), and duration [s] of each column.
    row_s : float
        Shortest time between readings of a recording.
    """

    torque_Nm: float
    motor_torque_Nm: float
    current_A: float
    load_torque_Nm: float
    deflection_rad: float
    stiffness: float
    speed_rad_per_s: float
    columns: tuple[str, ...]
    loads: tuple[str, ...]
    rig: Rig | None = None
    commands: frozenset[str | None] = frozenset({"duty"})
    peak_current_A: float | None = None
    often_read_A: float | None = None
    command: float = 0.3
    relative: bool = False
    angle_rad: float = 0.5
    time_s: float = 0.25
    widest_angle_rad: float | None = None
    begins_deflected: bool = True
    spans: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    row_s: float = 0.0

    def spread_of_loop(self, amplitude_rad: float) -> float | None:
        """Relative error (rms) of the loop of a spring at an amplitude far beyond those recorded.

        Laws that agree on what was recorded differ beyond: where all elements have slipped, the
        width stays; where further ones slip, it grows in proportion to the amplitude at most. Its
        growth is taken as r^u, u uniform from 0 to 1; this is the root mean square of r^u - 1.
        None for a bench, whose recordings reach the amplitude, and up to `KNOWN_TO`.
        """
        reach = KNOWN_TO * 0.5 * RANGE * self.deflection_rad
        if not self.relative or reach >= amplitude_rad:
            return None
        r, log_r = amplitude_rad / reach, np.log(amplitude_rad / reach)
        square = (r**2 - 1.0) / (2.0 * log_r) - 2.0 * (r - 1.0) / log_r + 1.0
        return float(np.sqrt(max(square, 0.0)))

    def like_inertia(self, bench: float) -> float:
        """An inertia at the output [kg m2], as `like_speed`: its torque in the motion for one."""
        own = self.load_torque_Nm * self.time_s / self.speed_rad_per_s
        return 0.01 * own if self.relative else bench

    def like_speed(self, bench: float) -> float:
        """A speed of the load [rad/s] that is to this machine's motion what `bench` is there."""
        return bench * self.speed_rad_per_s / BENCH_SPEED_rad_per_s if self.relative else bench

    def like_angle(self, bench: float) -> float:
        """An angle of the load [rad], as `like_speed`."""
        return bench * self.angle_rad / BENCH_ANGLE_rad if self.relative else bench

    def like_time(self, bench: float) -> float:
        """A time [s], as `like_speed`."""
        return bench * self.time_s / BENCH_TIME_s if self.relative else bench

    def like_motor_speed(self, bench: float) -> float:
        """A speed of the motor [rad/s], as `like_speed`."""
        return self.like_speed(bench) * self._gear

    def like_motor_angle(self, bench: float) -> float:
        """An angle of the motor [rad], as `like_speed`."""
        return self.like_angle(bench) * self._gear

    @property
    def cycle_of_travel(self) -> float:
        """Cycles in a turn of the output at which the widest motion is one cycle long."""
        return 2.0 * np.pi / (RANGE * (self.widest_angle_rad or self.angle_rad))

    def motor_passes(self, cycles: float) -> bool:
        """Whether the motor turns far enough to tell cycles (in a turn) from a smooth curve."""
        return not self.relative or cycles * self._ratio > LEAST_CYCLES * self.cycle_of_travel

    def rows_show(self, cycles: float) -> bool:
        """Whether one of these cycles (in a turn) lasts two rows at the motor's rms speed."""
        return cycles * self.speed_rad_per_s * self._ratio * self.row_s < np.pi

    @property
    def _ratio(self) -> float:
        return (self.rig.gear_ratio if self.rig is not None else None) or 1.0

    @property
    def _gear(self) -> float:
        return self._ratio / BENCH_RATIO if self.relative else 1.0
