"""The step that the fixed-step engine needs, from a model's numbers."""

import numpy as np
from numba import njit

import rsea_core.effects.layout as e
import rsea_core.machine.plant as mp
from rsea_core.engines.fixed_step.layout import as_plant
from rsea_core.machine.spring_table import C1

DEFAULT_STEP_s = 1e-3
STEP_PER_MODE = 0.1  # step times the fastest stiff mode, see benchmarks/step_halving.py


@njit(error_model="numpy", cache=True)
def longest_step_s(numbers, spring, fx):
    """The default step [s], less where a stiff mode of these numbers is faster than it allows.

    numbers : array of `Plant`'s fields; the current's own rate does not count (exact).
    """
    plant = as_plant(numbers)
    stiffness = fx[e.BOUC_WEN]
    for j in range(spring.shape[0]):
        stiffness = max(stiffness, spring[j, C1] + fx[e.BOUC_WEN])
    for j in range(e.N_SLIPS):
        stiffness += fx[e.SLIP_STIFFNESS + j]
    for j in range(e.N_BRANCHES):
        stiffness += fx[e.BRANCH_STIFFNESS + j]
    gear, load = plant.inertia, plant.load_inertia * e.least_inertia_factor(fx)
    tip = fx[e.LINK_INERTIA] if fx[e.LINK_STIFFNESS] > 0.0 else 0.0
    near = load
    output = fx[e.BACKLASH_INERTIA] if fx[e.BACKLASH] > 0.0 else gear
    moved = near if near > 0.0 else np.inf
    if plant.structure == mp.RIGID_FREE:
        stiffness = 0.0
        moved = gear = output = gear + near
    stiff = stiffness / output if output > 0.0 else 0.0
    on_load = stiffness + e.largest_parallel_stiffness(fx) + fx[e.LINK_STIFFNESS]
    on_load += e.position_stiffness(fx)
    if plant.contact_angle < np.inf:
        on_load += plant.contact_stiffness
        if fx[e.EXPONENT] > 0.0:
            deep = (e.DEEP_rad / fx[e.DEPTH]) ** (fx[e.EXPONENT] - 1.0)
            on_load += plant.contact_stiffness * fx[e.EXPONENT] * deep
    stiff += on_load / moved
    if tip > 0.0:
        stiff += fx[e.LINK_STIFFNESS] / tip
    if gear > 0.0:
        for wave in e.COGGING_HARMONICS:
            stiff += fx[wave] * fx[wave + 1] / gear
        if fx[e.GEAR_PRESLIDING] > 0.0:
            level = max(fx[e.GEAR_FORWARD], fx[e.GEAR_BACKWARD]) * (1.0 + fx[e.GEAR_RISE])
            stiff += level / (fx[e.GEAR_PRESLIDING] * gear)
    if fx[e.LOAD_PRESLIDING] > 0.0:
        stiff += fx[e.LOAD_COULOMB] * (1.0 + fx[e.LOAD_RISE]) / (fx[e.LOAD_PRESLIDING] * moved)
    rate = np.sqrt(max(stiff, 0.0))
    damping = fx[e.SPRING_DAMPING] + fx[e.LINK_DAMPING]
    slowed = damping / moved
    if output > 0.0:
        slowed += fx[e.SPRING_DAMPING] / output
    if tip > 0.0:
        slowed += fx[e.LINK_DAMPING] / tip
    rate = max(rate, slowed)
    return min(DEFAULT_STEP_s, STEP_PER_MODE / rate) if rate > 0.0 else DEFAULT_STEP_s
