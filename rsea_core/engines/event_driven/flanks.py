"""The play between motor side and wheel: what its flanks pass on. Compiled.

`y[FLANK]` is 0 while the wheel is free in the gap, +-1 where the flank on that side presses, and
+-TOUCHING where flanks move together and press nothing. The last one is needed because a worm's
friction depends on the transmitted torque: with s the flank's side and lambda(f) its torque under
a friction f on the motor side, which moves towards the flank,

    s lambda(F_c + c |tau|) >= 0                    it presses, friction F_c + c |tau|
    s lambda(F_c) <= 0                              it parts, friction F_c
    s lambda(F_c + c |tau|) < 0 < s lambda(F_c)     neither: with the friction of flanks that press
                                                    they part, with that of free ones they meet

In the third case the friction is between both levels, such that lambda = 0: the solution of
Filippov (Differential Equations with Discontinuous Righthand Sides, 1988, par. 4). Accelerations
pass into those of the first and the second case without a jump, so that switches do not follow
each other without end.
"""

from numba import njit

import rsea_core.effects.layout as e
import rsea_core.engines.event_driven.states as k

TOUCHING = 2.0


@njit(error_model="numpy", inline="always")
def meshing(fx, y, output):
    """The torque that the gear's mesh carries: none while the wheel is free in its play."""
    return 0.0 if fx[e.BACKLASH] > 0.0 and y[k.FLANK] == 0.0 else output


@njit(error_model="numpy", inline="always")
def friction_without_pressing(plant, fx, y, wheel, load_torque):
    """Friction [Nm] on the motor side with which touching flanks pass no torque.

    `wheel` moves the motor side without friction, `load_torque`: of the spring on the wheel.
    """
    behind = fx[e.BACKLASH_INERTIA]
    return (
        wheel + (plant.inertia - behind) * (load_torque + fx[e.BACKLASH_DAMPING] * y[k.WB]) / behind
    )


@njit(error_model="numpy", inline="always")
def wheel_rates(plant, fx, y, wheel, load_torque, stuck, derivatives, row):
    """Accelerations on the motor side and behind the backlash; `load_torque`: of the spring."""
    if fx[e.BACKLASH] == 0.0:
        derivatives[row, k.WW] = (wheel - load_torque) / plant.inertia
        return
    motor, behind = plant.inertia - fx[e.BACKLASH_INERTIA], fx[e.BACKLASH_INERTIA]
    load_torque += fx[e.BACKLASH_DAMPING] * y[k.WB]
    derivatives[row, k.TB] = y[k.WB]
    if y[k.FLANK] == 0.0:
        derivatives[row, k.WW], derivatives[row, k.WB] = wheel / motor, -load_torque / behind
    else:
        derivatives[row, k.WW] = derivatives[row, k.WB] = (wheel - load_torque) / plant.inertia
        if stuck:
            derivatives[row, k.TB] = derivatives[row, k.WB] = 0.0


@njit(error_model="numpy", inline="always")
def settled(side, with_load, without_load):
    """What y[FLANK] is, by the flank's torques with and without the friction of the load."""
    if side * with_load >= 0.0:
        return side
    return side * TOUCHING if side * without_load > 0.0 else 0.0


@njit(error_model="numpy")
def after_impact(fx, front, behind, before, at, side, parting):
    """Speeds of the motor side and of the wheel behind the backlash, after which they part so fast.

    A worm's friction takes its share of the impact too: driven, the motor side gives more than
    the wheel gets; back-driven it gets less, nothing where the worm locks. Which of them it is can
    change within the impact, where the motor side comes to rest.
    """
    for _ in range(2):
        loss = -fx[e.GEAR_BACKDRIVE_LOSS]
        if before * side > 0.0:
            loss = fx[e.GEAR_DRIVE_LOSS]
        seen = max(behind * (1.0 + loss), 0.0)
        after = (front * before + seen * (at - side * parting)) / (front + seen)
        if before * side <= 0.0 or after * side >= 0.0:
            return after, after + side * parting
        at += front * before / seen
        before = 0.0
    return after, after + side * parting
