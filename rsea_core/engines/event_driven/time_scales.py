"""How fast the terms' own nonlinearities can pass: what the integration step must follow."""

import numpy as np

import rsea_core.effects.layout as e


def rates_per_s(
    fx,
    *,
    inertia,
    load_inertia,
    wheel_speed,
    gear_ratio,
    contact_stiffness,
    spring_stiffness,
    supply_V,
    inductance,
):
    """How fast the terms' own nonlinearities can pass [1/s], at speeds up to wheel_speed."""
    rates = [fx[e.RIPPLE_CYCLES] * wheel_speed if fx[e.RIPPLE] != 0.0 else 0.0]
    if fx[e.INERTIA_COSINE] != 0.0 or fx[e.INERTIA_SINE] != 0.0:
        rates.append(fx[e.INERTIA_CYCLES] * wheel_speed)
    if fx[e.DEAD_TIME] > 0.0 and inductance > 0.0:
        rates.append(fx[e.DEAD_TIME] * supply_V / (fx[e.DEAD_TIME_CURRENT] * inductance))
    smooth = fx[e.GEAR_VISCOUS] + abs(fx[e.VISCOUS_SKEW])
    if smooth != 0.0 or fx[e.ATAN_LEVEL] != 0.0:
        slope = fx[e.ATAN_LEVEL] / fx[e.ATAN_VELOCITY] if fx[e.ATAN_LEVEL] != 0.0 else 0.0
        rates.append((smooth + slope) / inertia)
    # of the Stribeck curve, by rise over velocity; the usual shape has 0.86
    steepest = max(np.sqrt(2.0 / np.e), 0.5 + 0.25 * fx[e.STRIBECK_SHAPE])
    if fx[e.GEAR_RISE] > 0.0:
        coulomb = max(fx[e.GEAR_FORWARD], fx[e.GEAR_BACKWARD])
        rates.append(steepest * coulomb * fx[e.GEAR_RISE] / (fx[e.GEAR_STRIBECK] * inertia))
    if fx[e.LOAD_RISE] > 0.0:
        moving = load_inertia if load_inertia > 0.0 else inertia
        rates.append(
            steepest * fx[e.LOAD_COULOMB] * fx[e.LOAD_RISE] / (fx[e.LOAD_STRIBECK] * moving)
        )
    for wave in e.COGGING_HARMONICS:
        if fx[wave] != 0.0:
            rates.append(np.sqrt(fx[wave] * fx[wave + 1] / inertia))
            rates.append(fx[wave + 1] * wheel_speed)
    if fx[e.WHEEL_ERROR] != 0.0:
        rates.append(fx[e.WHEEL_CYCLES] * wheel_speed)
    if fx[e.WORM_ERROR] != 0.0:
        rates.append(gear_ratio * wheel_speed)
    if fx[e.WORM_ERROR_2] != 0.0:
        rates.append(2.0 * gear_ratio * wheel_speed)
    if fx[e.WORM_ERROR_3] != 0.0:
        rates.append(3.0 * gear_ratio * wheel_speed)
    parallel = e.largest_parallel_stiffness.py_func(fx)
    if parallel > 0.0 and load_inertia > 0.0:
        rates.append(np.sqrt(parallel / load_inertia))
    if fx[e.UNBALANCE] > 0.0 and load_inertia > 0.0:
        rates.append(3.0 * np.sqrt(fx[e.UNBALANCE] / load_inertia))
    if fx[e.POSITION_STEP] != 0.0 and load_inertia > 0.0:
        rates.append(3.0 * np.sqrt(e.position_stiffness(fx) / load_inertia))
    if fx[e.EXPONENT] > 0.0 and load_inertia > 0.0:
        deep = contact_stiffness * fx[e.DEPTH] * (e.DEEP_rad / fx[e.DEPTH]) ** fx[e.EXPONENT]
        rates.append(np.sqrt(deep * fx[e.EXPONENT] / (e.DEEP_rad * load_inertia)))
        rates.append(deep * fx[e.LOSS_FACTOR] / load_inertia)
    if fx[e.INTERNAL_STATES] != 0.0:
        rates += _internal_rates_per_s(fx, inertia, load_inertia, wheel_speed, spring_stiffness)
    return max(rates)


def _internal_rates_per_s(fx, inertia, load_inertia, wheel_speed, spring_stiffness):
    """Those of the terms that remember; every stiffness as if all elements stuck."""
    stiffness = spring_stiffness + fx[e.BOUC_WEN]
    for first, count in ((e.SLIP_STIFFNESS, e.N_SLIPS), (e.BRANCH_STIFFNESS, e.N_BRANCHES)):
        stiffness += fx[first : first + count].sum()
    motor, wheel = inertia, inertia
    if fx[e.BACKLASH] > 0.0:
        motor, wheel = inertia - fx[e.BACKLASH_INERTIA], fx[e.BACKLASH_INERTIA]
    inverse = 1.0 / wheel + (1.0 / load_inertia if load_inertia > 0.0 else 0.0)
    rates = [np.sqrt(stiffness * inverse), fx[e.SPRING_DAMPING] * inverse]
    rates += [1.0 / time for time in fx[e.BRANCH_TIME : e.BRANCH_TIME + e.N_BRANCHES] if time > 0.0]
    if fx[e.BOUC_WEN] > 0.0:
        rates.append(fx[e.BOUC_WEN_EXPONENT] * wheel_speed / fx[e.BOUC_WEN_YIELD])
    if fx[e.GEAR_PRESLIDING] > 0.0:
        level = max(fx[e.GEAR_FORWARD], fx[e.GEAR_BACKWARD]) * (1.0 + fx[e.GEAR_RISE])
        rates.append(np.sqrt(level / fx[e.GEAR_PRESLIDING] / motor))
        # of bristles, twice of it where the motion turns; their own rate is `bristles`' matter
        rates.append(2.0 * fx[e.GEAR_BRISTLE_DAMPING] / motor)
    if load_inertia > 0.0 and fx[e.LOAD_PRESLIDING] > 0.0:
        level = fx[e.LOAD_COULOMB] * (1.0 + fx[e.LOAD_RISE])
        rates.append(np.sqrt(level / fx[e.LOAD_PRESLIDING] / load_inertia))
        rates.append(2.0 * fx[e.LOAD_BRISTLE_DAMPING] / load_inertia)
    if fx[e.LINK_STIFFNESS] > 0.0:
        inverse = 1.0 / fx[e.LINK_INERTIA] + 1.0 / load_inertia
        rates += [np.sqrt(fx[e.LINK_STIFFNESS] * inverse), fx[e.LINK_DAMPING] * inverse]
    if fx[e.WINDING_CAPACITY] > 0.0:
        rates.append(fx[e.WINDING_TO_CASE] / fx[e.WINDING_CAPACITY])
        both = fx[e.WINDING_TO_CASE] + fx[e.CASE_TO_AMBIENT]
        rates.append(both / fx[e.CASE_CAPACITY])
    return rates
