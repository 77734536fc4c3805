"""A load that is said to be locked and moves: a clamp is as stiff as it is."""

from dataclasses import dataclass, replace

import numpy as np

from rsea_core.machine.inputs import Load
from rsea_core.recordings.case import Case, noise_floor
from rsea_core.recordings.recording import Recording

MOVES = 10.0  # deviations of a single reading, peak to peak, beyond which a load moves
FOLLOWS = 0.7  # correlation of that motion with the torque on it: a clamp that yields


@dataclass(frozen=True, kw_only=True)
class YieldingClamp:
    """A locked load whose angle follows the spring's torque.

    Attributes
    ----------
    file : str
    travel_rad : float
        Peak to peak.
    stiffness_Nm_per_rad : float
        Torque on the clamp over its angle, by least squares.
    """

    file: str
    travel_rad: float
    stiffness_Nm_per_rad: float

    def sentence(self) -> str:
        """What was found and what is done about it."""
        return (
            f"{self.file}: the locked load moves by {self.travel_rad:.2g} rad with the spring's"
            f" torque ({self.stiffness_Nm_per_rad:.3g} Nm/rad): its logged angle is taken as given"
        )


def with_yielding_clamps(case: Case) -> tuple[Case, tuple[YieldingClamp, ...]]:
    """The case with the logged motion of each locked load that moves, and what moved."""
    recordings, found = [], []
    for r in case.recordings:
        clamp = _yielding(case, r)
        if clamp is not None:
            found.append(clamp)
            r = replace(r, load=Load(kind="imposed"))
        recordings.append(r)
    return replace(case, recordings=tuple(recordings)), tuple(found)


def _yielding(case: Case, r: Recording) -> YieldingClamp | None:
    """The clamp of a recording; None where it holds, or nothing shows that it does not."""
    rig = case.rig
    both = "load_angle_rad" in r.responses and "motor_angle_rad" in r
    if r.load.kind != "locked" or not both or not rig.spring_stiffness_Nm_per_rad:
        return None
    load = r["load_angle_rad"]
    deflection = r["motor_angle_rad"] / (rig.gear_ratio or 1.0) - load
    travel = float(np.ptp(np.quantile(load, (0.01, 0.99))))
    if travel < MOVES * noise_floor(rig, r)["load_angle_rad"]:
        return None
    torque = rig.spring_stiffness_Nm_per_rad * (deflection - np.mean(deflection))
    motion = load - np.mean(load)
    power = float(np.linalg.norm(torque) * np.linalg.norm(motion))
    along = float(torque @ motion)
    if along < FOLLOWS * power or power == 0.0:
        return None
    return YieldingClamp(
        file=r.file, travel_rad=travel,
        stiffness_Nm_per_rad=along / float(motion @ motion),
    )  # fmt: skip
