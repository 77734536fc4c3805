"""A gear train without a spring whose two encoders disagree, with the gear's mesh as a spring.

Without a spring motor and load are one rigid body, and backlash between them changes no
prediction. Where neither the rig's values nor any law brings the two angles into agreement, the
mesh becomes a spring with a damper in parallel, in which backlash acts. Its stiffness and its
damping are no claims. A stiff penalty contact with a damper stands for
the mesh in the gear models of Nordin & Gutman, Automatica 38 (2002) 1633, section 2.
"""

from dataclasses import replace

import numpy as np

from rsea_core.effects.gear_backlash import GearBacklash
from rsea_core.effects.spring_viscoelastic import SpringViscoelastic
from rsea_core.effects.variant import Law, Unknown, writes_numbers
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.multistep.criteria import DISAGREE, MESH_ROWS, MESH_TOLERANCE
from rsea_core.identify.multistep.log_nuisances import MESH_DAMPER
from rsea_core.machine.rig import Rig
from rsea_core.recordings.case import Case, noise_floor
from rsea_core.recordings.recording import Recording

BOTH = ("motor_angle_rad", "load_angle_rad")
DAMPING_RATIO = 0.2  # of the mesh, before a fit


def encoders_disagree(found: Found) -> bool:
    """Whether what was found leaves the two angles of a rigid train apart by more than noise."""
    for t in found.estimator.tracks:
        e = t.experiment
        if e.read_twice and "torque_Nm" not in e.channels:
            at = [e.channels.index(name) for name in BOTH]
            if np.any(t.noise.of_readings[at] > DISAGREE * e.floor_of_each[at]):
                return True
    return False


def shows_lost_motion(case: Case) -> bool:
    """Whether the readings alone, before any fit, show backlash in a train without a spring.

    Their difference then exceeds the noise, and no offset, scale factor or delay of a reading and
    no transmission error (periodic in the turns of wheel and worm) accounts for it.
    """
    rig = case.rig
    if rig.has("spring") or not rig.has("gear"):
        return False
    read = [r for r in case.identification if all(n in r and n not in r.derived for n in BOTH)]
    return any(_left_by_harmonics(r, rig) > DISAGREE for r in read)


def _left_by_harmonics(r: Recording, rig: Rig) -> float:
    """Difference of the angles [noise floors] that these leave (`shows_lost_motion`)."""
    ratio = rig.gear_ratio or 1.0
    wheel = r["motor_angle_rad"] / ratio
    smooth = [np.ones_like(wheel), wheel, np.gradient(wheel, r.time_s)]
    orders = (1.0, 2.0, ratio, 2.0 * ratio)
    harmonics = [part(n * wheel) for n in orders for part in (np.sin, np.cos)]
    columns, difference = np.stack([*smooth, *harmonics], axis=1), r["load_angle_rad"] - wheel
    left = difference - columns @ np.linalg.lstsq(columns, difference, rcond=None)[0]
    floors = noise_floor(rig, r)
    floor = np.hypot(floors["load_angle_rad"], floors["motor_angle_rad"] / ratio)
    return float(np.std(left) / floor)


def with_gear_mesh(case: Case) -> tuple[Case, tuple[Law, ...]] | None:
    """The case with the mesh as its spring, and the mesh's damper; None without two inertias."""
    rig = case.rig
    motor = (rig.gear_ratio or 1.0) ** 2 * (rig.motor_inertia_kgm2 or 0.0)
    motor += rig.output_inertia_kgm2 or 0.0
    load = rig.load_inertia_kgm2 or 0.0
    if not (rig.has("gear") and motor > 0.0 and load > 0.0):
        return None
    reduced = motor * load / (motor + load)
    row = max(r.sample_time_s for r in case.identification)
    stiffness = reduced * (2.0 * np.pi / (MESH_ROWS * row)) ** 2
    damping = 2.0 * DAMPING_RATIO * np.sqrt(stiffness * reduced)
    return replace(case, rig=_elastic(rig, float(stiffness))), (_damper(float(damping)),)


def first_laws(laws: list[Law]) -> list[Law]:
    """Those that a search with the gear's mesh begins with."""
    return [law for law in laws if law.effect == GearBacklash.effect]


def _elastic(rig: Rig, stiffness: float) -> Rig:
    tolerances = dict(rig.tolerances) | {"spring_stiffness_Nm_per_rad": MESH_TOLERANCE}
    return replace(
        rig, parts=(*rig.parts, "spring"), spring_stiffness_Nm_per_rad=stiffness,
        tolerances=tuple(tolerances.items()),
    )  # fmt: skip


def _damper(damping: float) -> Law:
    value = Unknown(
        name="damping_Nms_per_rad", unit="Nms/rad", low=0.0, high=25.0 * damping,
        scale=0.2 * damping, prior=5.0 * damping,
    )  # fmt: skip
    return Law(
        effect=MESH_DAMPER, law="damper", subsystem="gear", kind=SpringViscoelastic,
        write=writes_numbers(SpringViscoelastic), unknowns=(value,), starts=((damping,),),
        nuisance=True,
    )  # fmt: skip


def as_effect(law: Law) -> Law:
    """The law as `model.toml` states it: the damper of a mesh that is the model's spring."""
    return replace(law, effect=law.kind.effect) if law.effect == MESH_DAMPER else law
