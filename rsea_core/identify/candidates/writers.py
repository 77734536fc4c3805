"""What each law writes into the engine's numbers of a machine, by the values of its knobs."""

from collections.abc import Mapping

import numpy as np

import rsea_core.effects.layout as e
import rsea_core.machine.plant as mp
from rsea_core.effects.drive_thermal import COPPER_per_K
from rsea_core.identify.candidates.candidate import PLANT, Draft, Where, Write
from rsea_core.identify.candidates.initial_temperatures import (
    CASE_J_per_K,
    CASE_TO_AIR_W_per_K,
    heat_of_the_past,
    rested,
)

# ---- gear


def write_gear_friction(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """Coulomb, Stribeck, presliding and asymmetric friction of motor and gear."""
    level = v["coulomb_Nm"] * w.ratio
    skew = v.get("asymmetry", 0.0)
    if level > 0.0:
        d.put(e.WHEEL_DRY, 1.0)
        d.put(e.GEAR_FORWARD, level * (1.0 + skew))
        d.put(e.GEAR_BACKWARD, level * (1.0 - skew))
    if "viscous_asymmetry" in v:
        damping = d.plant[PLANT["damping"]]
        if d.plant[PLANT["structure"]] == mp.RIGID_FREE:
            damping += d.plant[PLANT["load_damping"]]
        d.put(e.VISCOUS_SKEW, v["viscous_asymmetry"] * damping)
    if level == 0.0:
        return
    if "stribeck_rise" in v:
        d.put(e.GEAR_RISE, v["stribeck_rise"])
        d.put(e.GEAR_STRIBECK, v["stribeck_velocity_rad_per_s"] / w.ratio)
    if "presliding_rad" in v:
        d.put(e.GEAR_PRESLIDING, v["presliding_rad"] / w.ratio)
    if "bristle_rad" in v:
        d.put(e.GEAR_PRESLIDING, v["bristle_rad"] / w.ratio)
        d.put(e.GEAR_BRISTLE, 1.0)
        d.put(e.GEAR_BRISTLE_DAMPING, v.get("bristle_damping_Nms_per_rad", 0.0) * w.ratio**2)


def write_gear_efficiency(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """Friction in proportion to the transmitted torque, by its efficiencies.

    With `stribeck_rise` it is larger by that share where the thread hardly slides, and falls
    exponentially with the speed: between Stribeck's square and the roots of worm gears' standards
    (AGMA 6022: exp(-0.11 v^0.45)).
    """
    drive, back = 1.0 / v["drive_efficiency"] - 1.0, 1.0 - v["backdrive_efficiency"]
    if drive == 0.0 and back == 0.0:
        return
    d.put(e.WHEEL_DRY, 1.0)
    d.put(e.GEAR_DRIVE_LOSS, drive)
    d.put(e.GEAR_BACKDRIVE_LOSS, back)
    if "bristle_rad" in v:
        d.put(e.GEAR_PRESLIDING, v["bristle_rad"] / w.ratio)
        d.put(e.GEAR_BRISTLE, 2.0)
    if "stribeck_rise" in v:
        d.put(e.GEAR_RISE, v["stribeck_rise"])
        d.put(e.GEAR_STRIBECK, v["stribeck_velocity_rad_per_s"] / w.ratio)
        d.put(e.STRIBECK_SHAPE, 1.0)


def write_backlash(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """Lost motion between motor and wheel; part of inertia and damping sits behind it.

    Where in its play the wheel rests when a recording begins, the first torque reading tells.
    """
    if v["width_rad"] <= 0.0:
        return
    wheel, damping = v.get("wheel_inertia_kgm2", 2e-3), v.get("wheel_damping_Nms_per_rad", 0.0)
    d.put(e.BACKLASH, v["width_rad"])
    d.put(e.BACKLASH_REBOUND, v.get("rebound", 0.0))
    d.put(e.BACKLASH_INERTIA, min(wheel, 0.5 * d.plant[PLANT["inertia"]]))
    d.put(e.BACKLASH_DAMPING, min(damping, 0.5 * d.plant[PLANT["damping"]]))
    if w.start_torque_Nm is not None and d.stiffness > 0.0:
        d.start_bend_rad = w.start_torque_Nm / d.stiffness


def write_transmission_error(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """Position error once and twice per turn of wheel and worm, thrice per turn of the worm.

    It counts from where the angles read zero. A spring is slack there: what the phases of wheel
    and worm make there is in no reading.
    """
    at_zero = 0.0
    for kind, wave, amplitude, phase in (
        ("wheel", "", e.WHEEL_ERROR, e.WHEEL_PHASE),
        ("worm", "", e.WORM_ERROR, e.WORM_PHASE),
        ("wheel", "2_", e.WHEEL_ERROR_2, e.WHEEL_PHASE_2),
        ("worm", "2_", e.WORM_ERROR_2, e.WORM_PHASE_2),
        ("worm", "3_", e.WORM_ERROR_3, e.WORM_PHASE_3),
    ):
        pair = f"{kind}_sin_{wave}rad", f"{kind}_cos_{wave}rad"
        if not v.keys().isdisjoint(pair):
            a, b = (v[name] for name in pair)
            d.put(amplitude, float(np.hypot(a, b)))
            d.put(phase, float(np.arctan2(b, a)))
            at_zero += b
    d.put(e.ERROR_AT_ZERO, at_zero)


def write_cogging(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """Up to three waves of torque over the motor's angle."""
    for at, wave in zip(e.COGGING_WAVES, ("", "2_", "3_"), strict=True):
        if f"sin_{wave}Nm" in v:
            a, b = v[f"sin_{wave}Nm"], v[f"cos_{wave}Nm"]
            d.put(at, w.ratio * float(np.hypot(a, b)))
            d.put(at + 1, v[f"cycles_{wave}per_rev"] * w.ratio)
            d.put(at + 2, float(np.arctan2(b, a)))


# ---- drive


def write_dead_zone(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """No output for small duties."""
    d.put(e.DEAD_ZONE, v["width_duty"])


def write_dead_time(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """A bridge whose dead time takes voltage against the current, softly about zero."""
    d.put(e.DEAD_TIME, v["width_duty"])
    d.put(e.DEAD_TIME_CURRENT, v["crossover_A"])


def write_sag(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """A supply with a resistance of its own, behind a capacitor at the bridge."""
    d.put(e.SOURCE_RESISTANCE, v["source_resistance_ohm"])


def write_sag_one_way(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """The same where the supply takes nothing back, as behind a rectifier with a brake chopper."""
    write_sag(v, d, w)
    d.put(e.SOURCE_ONE_WAY, 1.0)


def write_sag_bare(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """The same without a capacitor: while the bridge is on the supply carries all current."""
    write_sag(v, d, w)
    d.put(e.SOURCE_RIPPLES, 1.0)


def write_limit(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """A lower current limit."""
    at = PLANT["current_limit"]
    d.plant[at] = min(d.plant[at], v["current_limit_A"])


def write_delay(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """A late command."""
    d.put(e.COMMAND_DELAY, v["delay_s"])


def write_thermal(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """Winding and case warm, and stay so from one recording to the next; copper, magnets follow."""
    capacity = v["winding_heat_capacity_J_per_K"]
    across, case = capacity / v["winding_time_s"], v.get("case_heat_capacity_J_per_K", CASE_J_per_K)
    pause_s = v.get("pause_s", 10.0)
    d.put(e.WINDING_CAPACITY, capacity)
    d.put(e.WINDING_TO_CASE, across)
    d.put(e.CASE_CAPACITY, case)
    d.put(e.CASE_TO_AMBIENT, CASE_TO_AIR_W_per_K)
    d.put(e.RESISTANCE_RISE, COPPER_per_K)
    d.put(e.CONSTANT_FALL_WINDING, v.get("torque_constant_fall_per_winding_K", 0.0))
    if w.left_K is None:
        resistance = d.plant[PLANT["resistance"]]
        winding, warm = heat_of_the_past(w.past, resistance, capacity, across, case, pause_s)
    else:
        winding, warm = rested(w.left_K, w.case_rise_K, capacity, across, case, pause_s)
    measured = w.case_rise_K if w.case_rise_K > 0.0 else warm
    d.put(e.START_WINDING, measured + winding - warm)
    d.put(e.START_CASE, measured)


# ---- spring


def write_slip(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """Maxwell slip: elements that yield one after another."""
    d.start_memory = 1.0 - v.get("start_relaxed", 0.0)
    for j, (stiffness, yield_rad) in enumerate(slips_of(v)):
        d.put(e.SLIP_STIFFNESS + j, stiffness)
        d.put(e.SLIP_YIELD + j, yield_rad)


def slips_of(v: Mapping[str, float]) -> list[tuple[float, float]]:
    """Stiffness and yield stretch of each element; `ratio` spaces the yields of all by the first.

    One more after another yields at `ratio` times the stretch of the one before.
    """
    found = []
    for j in range(e.N_SLIPS):
        if f"stiffness_{j + 1}_Nm_per_rad" in v:
            yield_rad = v.get(f"yield_{j + 1}_rad", v["yield_1_rad"] * v.get("ratio", 1.0) ** j)
            found.append((v[f"stiffness_{j + 1}_Nm_per_rad"], yield_rad))
    return found


def write_bouc_wen(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """Bouc-Wen hysteresis."""
    d.start_memory = 1.0 - v.get("start_relaxed", 0.0)
    d.put(e.BOUC_WEN, v["stiffness_Nm_per_rad"])
    d.put(e.BOUC_WEN_YIELD, v["yield_rad"])
    d.put(e.BOUC_WEN_EXPONENT, v["exponent"])
    d.put(e.BOUC_WEN_SHAPE, 0.5)


def write_visco(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """Damping and relaxing branches in parallel to the spring."""
    if "damping_Nms_per_rad" in v:
        d.put(e.SPRING_DAMPING, v["damping_Nms_per_rad"])
    for j in range(e.N_BRANCHES):
        if f"branch_stiffness_{j + 1}_Nm_per_rad" in v:
            d.put(e.BRANCH_STIFFNESS + j, v[f"branch_stiffness_{j + 1}_Nm_per_rad"])
            d.put(e.BRANCH_TIME + j, v[f"branch_time_{j + 1}_s"])


def write_hardening(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """K (d + c d^3) up to 0.3 rad, or where a softening spring has a quarter left."""
    K, ratio = d.stiffness, v["stiffness_ratio_at_0p15rad"]
    extent = 0.3 if ratio >= 1.0 else 0.15 * min(np.sqrt(0.75 / (1.0 - ratio)), 2.0)
    cubic = K * (ratio - 1.0) / (3.0 * 0.15**2)
    torque, tangent = K * extent + cubic * extent**3, K + 3.0 * cubic * extent**2
    bend = 3.0 * cubic * extent
    d.spring = np.array(
        [
            (-extent, -extent, -torque, tangent, 0.0, 0.0),
            (0.0, -extent, -torque, tangent, -bend, cubic),
            (extent, 0.0, 0.0, K, 0.0, cubic),
            (np.inf, extent, torque, tangent, 0.0, 0.0),
        ]
    )


def write_contact_spring(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """Coils touch past an onset: the stiffness is larger beyond, on one or both sides.

    With `round_rad` it grows over that width about the onset, where the asymptotes meet; with
    `onset_backward_rad` unwinding has an onset of its own.
    """
    K, side = d.stiffness, v.get("side", 0.0)
    more = K * (v["stiffness_after_over_before"] - 1.0)
    width = v.get("round_rad", 0.0)
    forward, backward = v["onset_rad"], v.get("onset_backward_rad", v["onset_rad"])
    low, high = [], []
    if side <= 0.0:
        half = min(0.5 * width, 0.9 * backward)
        a, b = backward - half, backward + half
        end = -K * b - more * half
        low.append((-b, -b, end, K + more, 0.0, 0.0))
        if half > 0.0:
            low.append((-a, -a, -K * a, K, -0.25 * more / half, 0.0))
    if side >= 0.0:
        half = min(0.5 * width, 0.9 * forward)
        a, b = forward - half, forward + half
        if half > 0.0:
            high.append((b, a, K * a, K, 0.25 * more / half, 0.0))
        high.append((np.inf, b, K * b + more * half, K + more, 0.0, 0.0))
    first = high[0][1] if high else np.inf
    d.spring = np.array([*low, (first, 0.0, 0.0, K, 0.0, 0.0), *high])


# ---- load


def write_load_friction(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """Dry friction of the load's joint."""
    if v["coulomb_Nm"] == 0.0 or w.kind in ("locked", "imposed"):
        return
    d.put(e.LOAD_DRY, 1.0)
    d.put(e.LOAD_COULOMB, v["coulomb_Nm"])
    if "stribeck_rise" in v:
        d.put(e.LOAD_RISE, v["stribeck_rise"])
        d.put(e.LOAD_STRIBECK, v["stribeck_velocity_rad_per_s"])
    if "presliding_rad" in v:
        d.put(e.LOAD_PRESLIDING, v["presliding_rad"])
    if "bristle_rad" in v:
        d.put(e.LOAD_PRESLIDING, v["bristle_rad"])
        d.put(e.LOAD_BRISTLE, 1.0)
        d.put(e.LOAD_BRISTLE_DAMPING, v.get("bristle_damping_Nms_per_rad", 0.0))


def _on_moving_load(index: int, name: str, factor: float = 1.0) -> Write:
    def write(v: Mapping[str, float], d: Draft, w: Where) -> None:
        if w.kind not in ("locked", "imposed"):
            d.put(index, factor * v[name])

    return write


def write_unbalance(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """A gravity torque that the rig does not name."""
    if w.kind in ("locked", "imposed", "free"):
        return
    a, b = v["sin_Nm"], v["cos_Nm"]
    d.put(e.UNBALANCE, float(np.hypot(a, b)))
    d.put(e.UNBALANCE_ANGLE, float(np.arctan2(b, a)))


def write_parallel(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """A second spring between load and ground."""
    if w.kind in ("locked", "imposed"):
        return
    d.put(e.PARALLEL, v["stiffness_Nm_per_rad"])
    d.put(e.PARALLEL_REST, v.get("rest_angle_rad", 0.0))


def write_link(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """A link whose outer part is joined by a stiffness."""
    if w.kind in ("locked", "imposed"):
        return
    inertia = v["tip_share"] * d.plant[PLANT["load_inertia"]]
    d.plant[PLANT["load_inertia"]] *= 1.0 - v["tip_share"]
    stiffness = inertia * (1.0 - v["tip_share"]) * (2.0 * np.pi * v["frequency_Hz"]) ** 2
    d.put(e.LINK_INERTIA, inertia)
    d.put(e.LINK_STIFFNESS, stiffness)
    d.put(e.LINK_DAMPING, 2.0 * v["damping_ratio"] * np.sqrt(stiffness * inertia))


def write_pulse(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """An outside torque for a while, in one recording."""
    if v.get("recording", w.index) != w.index or w.kind in ("locked", "imposed"):
        return
    d.put(e.PULSE, v["peak_Nm"])
    d.put(e.PULSE_START, v["start_s"])
    d.put(e.PULSE_END, v["start_s"] + v["width_s"])
    d.put(e.PULSE_TAPER, v.get("taper", 0.0))


def write_contact_law(v: Mapping[str, float], d: Draft, w: Where) -> None:
    """A contact by power law; the stiffness of the load is its secant at the reference depth."""
    if w.kind != "contact":
        return
    d.put(e.EXPONENT, v["exponent"])
    d.put(e.DEPTH, v.get("reference_depth_rad", 0.05))
    d.put(e.LOSS_FACTOR, v.get("loss_factor_s_per_rad", 0.0))


# ---- sensors


def _sensor(column: str, change) -> Write:
    def write(v: Mapping[str, float], d: Draft, w: Where) -> None:
        d.reads.append((column, lambda signal: change(v, signal, w)))
        if "offset" in v and column == "load_angle_rad":
            d.start_load_rad -= v["offset"]
        if "scale" in v and column == "load_angle_rad":
            d.start_load_scale /= v["scale"]
        if "scale" in v and column == "motor_angle_rad":
            d.start_motor_scale /= v["scale"]

    return write


def _offset(v, signal, w):
    return signal + v["offset"]


def _scale(v, signal, w):
    return signal * v["scale"]


def _late(v, signal, w):
    return np.interp(w.time_s - v["delay_s"], w.time_s, signal)


def _drift(v, signal, w):
    return signal + v["rate_per_s"] * (w.time_s - w.time_s[0] + v.get("session", 0.0) * w.session_s)
