"""What is wrong with a spring bench's files: nothing moves, another sign, another unit."""

from collections.abc import Sequence

import numpy as np

from rsea_core.identify.spring_bench.loops import BenchRows
from rsea_core.machine.rig import Rig
from rsea_core.recordings.case import noise_floor
from rsea_core.recordings.finding import Finding, Kind
from rsea_core.recordings.recording import Recording

STILL = 4.0  # sensor deviations of motion below which a reading does not move
FACTOR = 4.0  # of a stiffness that no spring is off its design by


def moves(rig: Rig, r: Recording, row: BenchRows) -> bool:
    """Whether torque and deflection of a recording both change beyond their noise."""
    floors = noise_floor(rig, r)
    floor = floors.get("spring_deflection_rad", 0.0)
    stands = np.std(row.deflection_rad) <= STILL * floor or np.ptp(row.deflection_rad) == 0.0
    quiet = np.std(row.torque_Nm) <= STILL * floors["torque_Nm"] or np.ptp(row.torque_Nm) == 0.0
    return not (stands or quiet)


def sign_findings(turned: Sequence[str]) -> tuple[Finding, ...]:
    """Which recordings' torque was turned."""
    if not turned:
        return ()
    few = ", ".join(turned[:3]) + (f" and {len(turned) - 3} more" if len(turned) > 3 else "")
    text = f"{few}: torque_Nm has the other sign than in most recordings; turned here"
    return (Finding(kind=Kind.SIGN, text=text, column="torque_Nm"),)


def is_other_unit(scale: float) -> bool:
    """Whether no tolerance of a spring makes a stiffness this many times the given one."""
    return not 1.0 / FACTOR <= scale <= FACTOR


def unit_findings(scale: float) -> tuple[Finding, ...]:
    """A stiffness that no tolerance of a spring makes."""
    if not is_other_unit(scale):
        return ()
    text = (
        f"the torque rises {scale:.4g} times as steeply as the given stiffness says: the unit of"
        " torque_Nm or of the deflection, or the given stiffness, is wrong"
    )
    return (Finding(kind=Kind.UNIT, text=text),)
