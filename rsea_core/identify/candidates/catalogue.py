"""Every variant that a diagnosis tries on a case, its starts scaled by the machine."""

from rsea_core.effects.base import Port, Term
from rsea_core.effects.registry import LAWS
from rsea_core.effects.sensor_base import FITTED
from rsea_core.effects.variant import Law, candidates_of
from rsea_core.identify.candidates.typical_magnitudes import scales_of
from rsea_core.recordings.case import Case


def catalogue(case: Case, *, relative: bool = False) -> dict[str, Law]:
    """The variants that this machine can have, by key."""
    s, rig = scales_of(case, relative=relative), case.rig
    moving = any(kind not in ("locked", "imposed") for kind in s.loads)
    there = {
        Port.DRIVE: rig.has("drive"),
        Port.GEAR: rig.has("gear"),
        Port.SPRING: rig.has("spring"),
        Port.LOAD: rig.has("load") and moving,
        Port.ENVIRONMENT: "contact" in s.loads,
        Port.SENSOR: True,
    }
    laws = [law for kind in _kinds() if there[kind.port] for law in candidates_of(kind, s)]
    return {law.key: law for law in sorted(laws, key=_column)}


def _kinds() -> list[type[Term]]:
    return [kind for laws in LAWS.values() for kind in laws.values()]


def _column(law: Law) -> int:
    """Machine first, then sensor by sensor."""
    return -1 if law.sensor is None else FITTED.index(law.sensor)
