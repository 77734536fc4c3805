"""The best torque controller on a self-locking worm, 1 Hz and 5 Nm, and a compensator 30 % wrong.

    python -m benchmarks.worm_task

Output clamped, 1 kHz, one sample of delay, the rig's encoders, judged from 1 s on. The targets
(RMSE of at most 0.016 Nm, at most 20 % worse with a compensator 30 % wrong, one and the same
controller) come from a study with 0.02 Nm of noise on the torque reading (specification,
actuator.md section 5). Printed are that condition, a mean over seeds, and the one without noise.
RMSE is of the true torque; "worse" is the worse of 30 % too little and too much compensation.

Without noise a full compensator leaves almost no error, so that any fault of it is large by
comparison: there LQG meets both with a compensator that it relies on by 40 %, and full reliance
is better in RMSE on either side, but not by that ratio. Exit status 1 where no controller meets
both in a condition.
"""

import math
import sys

from rsea_core import ActuatorModel, Load, Reference, Rig
from rsea_core.control import (
    Controller,
    DisturbanceObserverTorque,
    FuzzyTorque,
    LqgTorque,
    PidTorque,
)
from rsea_core.control.tuning.robustness import robustness
from rsea_core.control.tuning.tune import Task
from rsea_core.effects import GearFriction, GearLoadFriction

RIG = Rig.preset("rsea-bench")
LARGEST_Nm, WORSE_percent = 0.016, 20.0
NOISE_Nm = 0.02
CONTROLLERS: dict[str, Controller] = {
    "PID-FFC": PidTorque(kp=60.0, ki=10.0),
    "PID-FFC + compensation": PidTorque(kp=60.0, ki=10.0, friction_compensation=1.0),
    "FL-FFC": FuzzyTorque(),
    "FTC-FC": FuzzyTorque(friction_compensation=1.0),
    "disturbance observer": DisturbanceObserverTorque(),
    "LQG": LqgTorque(),
    "LQG + 40 % of compensation": LqgTorque(friction_compensation=0.4),
    "LQG + compensation": LqgTorque(friction_compensation=1.0),
}


def worm_task(noise_Nm: float) -> Task:
    """The task; the noise is that of a torque read through spring and motor encoder."""
    terms = (
        GearLoadFriction(lead_angle_rad=math.radians(4.0), friction_coefficient=0.075),
        GearFriction(coulomb_Nm=0.3 / RIG.gear_ratio),
    )
    on_motor = noise_Nm / RIG.spring_stiffness_Nm_per_rad * RIG.gear_ratio
    return Task(
        model=ActuatorModel(RIG, terms),
        loads=(Load(kind="locked"),),
        reference=Reference(kind="sine", amplitude_Nm=5.0, frequency_Hz=1.0),
        duration_s=3.0,
        from_s=1.0,
        noise=(on_motor, 0.0, 0.0),
    )


def judged(noise_Nm: float) -> bool:
    """Print the table of a condition; whether one controller meets both targets in it."""
    print(f"noise {noise_Nm:g} Nm:          RMSE (Nm)   compensator 30 % wrong")
    met = []
    for name, controller in CONTROLLERS.items():
        found = robustness(worm_task(noise_Nm), controller, machines=0, seed=0)
        worse = found.degradation_percent
        compensates = worse is not None
        text = f"{found.wrong_compensator_rmse:.4f} ({worse:+.0f} %)" if compensates else "-"
        print(f"  {name:28} {found.noisy_rmse:.4f}   {text}")
        if compensates and found.noisy_rmse <= LARGEST_Nm and worse <= WORSE_percent:
            met.append(name)
    print(f"  both targets, with a compensator: {', '.join(met) or 'NONE'}")
    return bool(met)


def main() -> int:
    conditions = [judged(noise) for noise in (NOISE_Nm, 0.0)]
    print("all targets met" if all(conditions) else "a target is missed")
    return 0 if all(conditions) else 1


if __name__ == "__main__":
    sys.exit(main())
