"""Laws that readings refute without a simulation: a parity relation of both angles and the torque.

With a linear spring, motor angle / ratio - load angle = torque / stiffness + constant; in a train
without a spring the left side is constant but for the ratio's error. This holds whatever moves the
machine and however badly its motion is predicted. If a linear regression leaves only white noise of
the sensors' size, no law is there that would add to either side. Relations of this kind are
"direct redundancy" in Chow & Willsky, IEEE Trans. Autom. Control 29 (1984) 603.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.registry import (
    GearBacklash,
    GearTransmissionError,
    SensorOffset,
    SensorScale,
    SpringContact,
    SpringHardening,
    SpringHysteresis,
    SpringViscoelastic,
)
from rsea_core.effects.variant import Law
from rsea_core.machine.rig import Rig
from rsea_core.recordings.case import Case, noise_floor
from rsea_core.recordings.recording import Recording

ANGLES, TORQUE = ("motor_angle_rad", "load_angle_rad"), "torque_Nm"
OF_SPRING = {
    k.effect for k in (SpringHysteresis, SpringViscoelastic, SpringHardening, SpringContact)
}
OF_TRAIN = {k.effect for k in (GearBacklash, GearTransmissionError)}
LARGEST = 1.5  # noise floors that the relation leaves, at most
WHITE = 2.0  # block means over those of white noise; 3.1 and more where a law acts (11 cases)
BLOCKS = 20  # of the longest means
VISIBLE = 40.0  # noise floors, standard deviation of what a law would act on


@dataclass(frozen=True, kw_only=True)
class AngleRelation:
    """A relation that the recordings satisfy, and how far its parts vary.

    Attributes
    ----------
    deflection, motion : float
        Standard deviations of the spring's deflection and of the load's angle, over the noise, in
        the recording where they are largest.
    elastic : bool
        A spring is between the encoders.
    """

    deflection: float
    motion: float
    elastic: bool

    @property
    def spring_is_linear(self) -> bool:
        """Whether the spring deflected enough to show a law of its own, and shows none."""
        return self.elastic and self.deflection > VISIBLE

    def refutes(self, law: Law) -> bool:
        """Whether the law would add to a side of the relation by more than noise."""
        if law.effect in OF_TRAIN or law.sensor in ANGLES:
            if law.effect == SensorOffset.effect or law.fixed_numbers.get("session"):
                return False  # a constant in each recording, or nearly
            if law.effect == SensorScale.effect and not self.elastic:
                return False  # the ratio's error
            return self.motion > VISIBLE
        if law.sensor == TORQUE and law.effect in (SensorOffset.effect, SensorScale.effect):
            return False  # the constant, the stiffness
        if law.effect in OF_SPRING or law.sensor == TORQUE:
            return self.spring_is_linear
        return False


def angle_relation(case: Case) -> AngleRelation | None:
    """The relation, if all recordings that are fitted have its readings and satisfy it."""
    elastic = case.rig.has("spring")
    needed = (*ANGLES, TORQUE) if elastic else ANGLES
    if not case.rig.has("gear") or not case.identification:
        return None
    deflection = motion = 0.0
    for r in case.identification:
        if r.quasi_static or not all(n in r and n not in r.derived for n in needed):
            return None
        part, floor, left = _regressed(r, case.rig, TORQUE if elastic else "load_angle_rad")
        if np.std(left) > LARGEST * floor or not _is_white(left):
            return None
        deflection = max(deflection, float(np.std(part)) / floor)
        motion = max(motion, float(np.std(r["load_angle_rad"])) / floor)
    return AngleRelation(deflection=deflection, motion=motion, elastic=elastic)


def _regressed(r: Recording, rig: Rig, on: str) -> tuple[NDArray, float, NDArray]:
    """Fitted part of the angles' difference, its noise floor [rad], and what is left (rows,)."""
    ratio = rig.gear_ratio or 1.0
    difference = r["motor_angle_rad"] / ratio - r["load_angle_rad"]
    columns = np.stack([r[on], np.ones(r.rows)], axis=1)
    slope, constant = np.linalg.lstsq(columns, difference, rcond=None)[0]
    floors = noise_floor(rig, r)
    floor = np.hypot(floors["motor_angle_rad"] / ratio, floors["load_angle_rad"])
    if on == TORQUE:
        floor = np.hypot(floor, slope * floors[TORQUE])
    part = slope * r[on]
    return part, float(floor), difference - part - constant


def _is_white(left: NDArray) -> bool:
    """Whether means of blocks of rows are no larger than those of white noise."""
    spread, rows = float(np.std(left)), 2
    while rows * BLOCKS <= left.size:
        means = left[: left.size // rows * rows].reshape(-1, rows).mean(axis=1)
        if np.std(means) * np.sqrt(rows) > WHITE * spread:
            return False
        rows *= 2
    return True
