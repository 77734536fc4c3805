"""Every variant that a file may hold, by key."""

from rsea_core.effects.drive_dead_zone import SERVO
from rsea_core.effects.drive_nonlinear_gain import DriveNonlinearGain
from rsea_core.effects.drive_offset import DriveOffset
from rsea_core.effects.formula_torque import formulas_to_read
from rsea_core.effects.load_disturbance import LoadDisturbance, disturbance
from rsea_core.effects.load_flexibility import LoadFlexibility
from rsea_core.effects.load_inertia_variation import LoadInertiaVariation
from rsea_core.effects.motor_cogging import CYCLES_TRIED, MotorCogging, cogging
from rsea_core.effects.registry import LAWS
from rsea_core.effects.residual_table import laws_to_read
from rsea_core.effects.sensor_base import FITTED
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, candidates_of


def laws_by_key() -> dict[str, Law]:
    """Every variant by key, for reading a model back: starts and scales are of no use there."""
    s = TypicalMagnitudes(
        torque_Nm=1.0, motor_torque_Nm=1.0, current_A=1.0, load_torque_Nm=1.0, deflection_rad=0.1,
        stiffness=1.0, speed_rad_per_s=1.0, columns=FITTED, loads=("pendulum", "contact"),
        relative=True, angle_rad=100.0, commands=frozenset({"duty", SERVO}),
    )  # fmt: skip
    kinds = [kind for laws in LAWS.values() for kind in laws.values()]
    laws = [law for kind in kinds for law in candidates_of(kind, s)]
    laws += [
        DriveOffset.nuisance(1.0, 1.0),
        DriveNonlinearGain.unnamed(1.0),
        LoadInertiaVariation.unnamed(1),
        *laws_to_read(FITTED),
        *formulas_to_read(),
        disturbance("", 0, (0.0, 1.0, 1.0), 1.0, 1.0),
    ]
    found = {law.key: law for law in laws}
    found |= {
        f"{law.effect}/*": law
        for law in laws
        if law.effect in (LoadFlexibility.effect, LoadDisturbance.effect)
    }
    found[f"{MotorCogging.effect}/*"] = cogging(s, CYCLES_TRIED[:3])
    return found
