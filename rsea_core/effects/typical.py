"""What is typical of a machine's recordings, by which starts and steps of variants are scaled."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from rsea_core.machine.rig import Rig


@dataclass(frozen=True, kw_only=True)
class Scales:
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
        The largest that was read.
    command : float
        Largest standard deviation of the command, in its own unit.
    relative : bool
        Whether starts and bounds follow the machine's own scales throughout, for any machine;
        else some are those of the bench.
    begins_bent : bool
        Whether a recording begins with a deflected spring.
    spans : mapping
        Standard deviation (of the largest), and duration [s] of each column.
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
    command: float = 0.3
    relative: bool = False
    begins_bent: bool = True
    spans: Mapping[str, tuple[float, float]] = field(default_factory=dict)
