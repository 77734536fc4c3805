"""Every law that a diagnosis tries on a case, its starts scaled by the machine."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import rsea_core.effects.layout as e
import rsea_core.identify.candidates.writers as w
from rsea_core.identify.candidates.candidate import Knob, Law
from rsea_core.identify.candidates.catalogue_gear import COGGING_CYCLES, cogging, gear_laws
from rsea_core.identify.candidates.residual_tables import laws_to_read
from rsea_core.identify.candidates.typical_magnitudes import Scales, scales_of
from rsea_core.recordings.case import Case

SENSOR_COLUMNS = (
    "motor_angle_rad",
    "load_angle_rad",
    "current_A",
    "torque_Nm",
    "spring_deflection_rad",
)
LONGEST = 0.5  # of a recording that a push may last: longer is not a push but a machine
BENT = 0.1  # of the largest deflection: more is no encoder's doing
LINK_Hz = (4.0, 6.0, 8.0, 10.0, 12.0, 14.0, 17.0, 20.0, 25.0, 32.0, 45.0)
# a tenth apart, as narrow as the valley in which a ring of some periods stays in step; one that
# falls between two of them at one share of the inertia is met at another
LINK_GRID = tuple(
    (float(f), share, 0.02)
    for share in (0.3, 0.45, 0.6, 0.7, 0.8) for f in np.geomspace(4.0, 100.0, 34)
)  # fmt: skip
LIGHT_kgm2 = 0.01  # of a load of which the rig's file says nothing
WEAKER_per_K = 2e-3  # magnets that warm with the winding: of ferrite, the weakest


def catalogue(case: Case) -> dict[str, Law]:
    """The laws that this machine can have, by key."""
    s = scales_of(case)
    laws = []
    rig = case.rig
    moving = any(kind not in ("locked", "imposed") for kind in s.loads)
    if rig.has("drive"):
        laws += _drive(case, s)
    if rig.has("gear"):
        laws += gear_laws(rig, s)
    if rig.has("spring"):
        laws += _spring(s, bent=_begins_bent(case, s))
    if rig.has("load") and moving:
        laws += _load(case, s)
    if "contact" in s.loads:
        laws += _environment()
    laws += _sensors(case, s)
    return {law.key: law for law in laws}


def _drive(case: Case | None, s: Scales) -> list[Law]:
    recordings = () if case is None else case.identification
    names = {r.command_name for r in recordings} if case is not None else {"duty"}
    found = []
    duty = "duty" in names
    if duty:
        found.append(
            Law(effect="drive-dead-zone", law="half-width", subsystem="drive",
                write=w.write_dead_zone,
                knobs=(Knob(name="width_duty", unit="-", low=0.0, high=0.3, scale=0.002),),
                starts=((0.002,), (0.008,), (0.03,)))
        )  # fmt: skip
        found.append(
            Law(effect="drive-dead-zone", law="dead time", subsystem="drive",
                write=w.write_dead_time,
                knobs=(Knob(name="width_duty", unit="-", low=0.0, high=0.3, scale=0.002),
                       Knob(name="crossover_A", unit="A", low=2e-3 * s.current_A, high=s.current_A,
                            scale=0.2, log=True, prior=1.5)),
                starts=((0.002, 0.03 * s.current_A), (0.008, 0.03 * s.current_A)))
        )  # fmt: skip
        R = 1.0 if case is None else case.rig.terminal_resistance_ohm or 1.0
        ohm = Knob(name="source_resistance_ohm", unit="ohm", low=0.0, high=10 * R, scale=0.05 * R)
        supply = {"effect": "drive-saturation", "subsystem": "drive", "knobs": (ohm,),
                  "starts": ((0.1 * R,), (0.5 * R,))}  # fmt: skip
        found += [
            Law(law="sag", write=w.write_sag, richer=("sag, no capacitor",),
                always=("sag, one way",), **supply),
            Law(law="sag, one way", write=w.write_sag_one_way, follows=True, **supply),
            Law(law="sag, no capacitor", write=w.write_sag_bare, follows=True, **supply),
        ]  # fmt: skip
    if names & {"duty", "voltage_V", "current_command_A"}:
        top = 10.0 * s.current_A if case is None else case.rig.current_limit_A or 10 * s.current_A
        seen = [np.percentile(np.abs(r["current_A"]), 99.9) for r in recordings
                if "current_A" in r and r.command_name != "current_A"]  # fmt: skip
        peak = min(float(max(seen)) if seen else top, top)
        found.append(
            Law(effect="drive-saturation", law="limit", subsystem="drive", write=w.write_limit,
                knobs=(Knob(name="current_limit_A", unit="A", low=0.02 * top, high=top,
                            scale=0.03 * top),),
                starts=((0.97 * peak,), (peak,), (0.8 * peak,), (0.6 * peak,)))
        )  # fmt: skip
    if names & {"duty", "voltage_V"}:
        capacity = Knob(
            name="winding_heat_capacity_J_per_K", unit="J/K", low=0.5, high=2000.0, scale=0.2,
            log=True,
        )  # fmt: skip
        heat = Knob(name="winding_time_s", unit="s", low=0.5, high=1000.0, scale=0.3, log=True,
                    prior=1.0)  # fmt: skip
        pause = Knob(name="pause_s", unit="s", low=0.01, high=1e5, scale=0.4, log=True, prior=2.0)
        fall = Knob(name="torque_constant_fall_per_winding_K", unit="1/K", low=0.0, high=0.005,
                    scale=3e-4, prior=WEAKER_per_K)  # fmt: skip
        starts = ((30.0, 20.0, 10.0), (8.0, 20.0, 10.0), (8.0, 5.0, 3.0))
        thermal = {"effect": "drive-thermal", "subsystem": "drive", "write": w.write_thermal}
        found += [
            Law(law="winding and case", knobs=(capacity, heat, pause), starts=starts,
                richer=("winding, case and magnets",), **thermal),
            Law(law="winding, case and magnets", knobs=(capacity, heat, pause, fall),
                starts=tuple((*values, 5e-4) for values in starts), **thermal),
        ]  # fmt: skip
    if names - {None, "current_A"}:
        found.append(
            Law(effect="drive-delay", law="dead time", subsystem="drive", write=w.write_delay,
                knobs=(Knob(name="delay_s", unit="s", low=0.0, high=0.1, scale=0.001),),
                starts=((0.002,), (0.006,), (0.015,)))
        )  # fmt: skip
    return found


def _begins_bent(case: Case, s: Scales) -> bool:
    """Whether a recording begins with the spring bent: let go from an angle."""
    ratio = case.rig.gear_ratio or 1.0
    for r in case.identification:
        if "load_angle_rad" in r and "motor_angle_rad" in r:
            bend = r["motor_angle_rad"][0] / ratio - r["load_angle_rad"][0]
            if abs(bend) > BENT * s.deflection_rad:
                return True
    return False


def _spring(s: Scales, *, bent: bool) -> list[Law]:
    """The spring's laws.

    Parameters
    ----------
    bent : bool
        Recordings begin with a bent spring: nobody knows how it was brought there, so that what
        a hysteresis remembers of it is free.
    """
    K = s.stiffness
    hysteresis = {"effect": "spring-hysteresis", "subsystem": "spring"}
    elements = [
        (
            Knob(name=f"stiffness_{j}_Nm_per_rad", unit="Nm/rad", low=0.0, high=3 * K,
                 scale=0.03 * K),
            Knob(name=f"yield_{j}_rad", unit="rad", low=2e-4, high=1.0, scale=0.15, log=True,
                 prior=1.0),
        )
        for j in range(1, e.N_SLIPS + 1)
    ]  # fmt: skip
    # a little beyond both ends, so that an end is no bound
    relaxed = Knob(name="start_relaxed", unit="-", low=-0.2, high=1.2, scale=0.1, prior=1.0)
    begun, at_begin = ((relaxed,), (0.0,)) if bent else ((), ())
    d = s.deflection_rad

    def slips(shares: Sequence[float], stiffness: float) -> tuple[float, ...]:
        found = tuple(v for share in shares for v in (stiffness / len(shares), share * d))
        return (*found, *at_begin)

    flat = [knob for pair in elements for knob in pair]
    spaced = (
        *(pair[0] for pair in elements),
        elements[0][1],
        Knob(name="ratio", unit="-", low=1.2, high=8.0, scale=0.1, log=True, prior=0.5),
        *begun,
    )
    damping = Knob(
        name="damping_Nms_per_rad", unit="Nms/rad", low=0.0, high=0.5 * K, scale=0.001 * K
    )
    branch = [
        (
            Knob(name=f"branch_stiffness_{j}_Nm_per_rad", unit="Nm/rad", low=0.0, high=3 * K,
                 scale=0.03 * K),
            Knob(name=f"branch_time_{j}_s", unit="s", low=2e-3, high=100.0, scale=0.15, log=True,
                 prior=1.5),
        )
        for j in (1, 2, 3)
    ]  # fmt: skip
    visco = {"effect": "spring-viscoelastic", "subsystem": "spring", "write": w.write_visco}
    onset = Knob(name="onset_rad", unit="rad", low=0.05 * d, high=6.0 * d, scale=0.03, log=True)
    after = Knob(name="stiffness_after_over_before", unit="-", low=1.0, high=30.0, scale=0.1,
                 log=True)  # fmt: skip
    back = replace(onset, name="onset_backward_rad")
    rounded = Knob(name="round_rad", unit="rad", low=1e-3 * d, high=3.0 * d, scale=0.2, log=True,
                   prior=1.5)  # fmt: skip
    sides = (("both ways", 0.0), ("forward", 1.0), ("backward", -1.0))
    return [
        Law(law="one slip", knobs=(*flat[:2], *begun), write=w.write_slip,
            starts=(slips((0.1,), 0.05 * K), slips((0.5,), 0.1 * K), slips((1.5,), 0.1 * K)),
            richer=("two slips", "four slips", "six slips", "bouc-wen"), **hysteresis),
        Law(law="two slips", knobs=(*flat[:4], *begun), write=w.write_slip,
            starts=(slips((0.15, 0.8), 0.15 * K),),
            richer=("four slips", "six slips", "bouc-wen"), **hysteresis),
        Law(law="four slips", knobs=(*flat[:8], *begun), write=w.write_slip,
            starts=(slips((0.05, 0.2, 0.6, 1.6), 0.2 * K), slips((0.1, 0.35, 0.8, 3.0), 0.1 * K)),
            **hysteresis),
        Law(law="six slips", knobs=spaced, write=w.write_slip,
            starts=((*(0.05 * K,) * 6, 0.02 * d, 2.2, *at_begin),
                    (*(0.02 * K,) * 6, 0.05 * d, 2.0, *at_begin)),
            **hysteresis),
        Law(law="bouc-wen", write=w.write_bouc_wen, richer=("four slips", "six slips"),
            knobs=(Knob(name="stiffness_Nm_per_rad", unit="Nm/rad", low=0.0, high=3 * K,
                        scale=0.03 * K),
                   Knob(name="yield_rad", unit="rad", low=1e-3, high=1.0, scale=0.15, log=True,
                        prior=1.0),
                   Knob(name="exponent", unit="-", low=1.0, high=5.0, scale=0.15, log=True,
                        prior=0.5), *begun),
            starts=((0.1 * K, 0.3 * d, 1.5, *at_begin),), **hysteresis),
        Law(law="damper", knobs=(damping,), starts=((0.0005 * K,), (0.004 * K,)),
            richer=("one branch", "two branches"), **visco),
        Law(law="one branch", knobs=branch[0],
            starts=((0.1 * K, 0.02), (0.1 * K, 0.15), (0.1 * K, 1.0)),
            richer=("two branches", "three branches"), **visco),
        Law(law="two branches", knobs=(*branch[0], *branch[1]),
            starts=((0.06 * K, 0.05, 0.06 * K, 1.0),), richer=("three branches",), **visco),
        Law(law="three branches", knobs=(*branch[0], *branch[1], *branch[2]),
            starts=((0.04 * K, 0.03, 0.04 * K, 0.3, 0.04 * K, 3.0),), **visco),
        Law(effect="spring-hardening", law="cubic", subsystem="spring", write=w.write_hardening,
            knobs=(Knob(name="stiffness_ratio_at_0p15rad", unit="-", low=0.3, high=10.0,
                        scale=0.05),),
            starts=((1.1,), (1.5,), (0.85,))),
        *(Law(effect="spring-contact", law=f"knee {name}", subsystem="spring",
              write=w.write_contact_spring,
              knobs=(onset, after, Knob(name="side", unit="-", low=side, high=side, scale=0.0)),
              starts=tuple((f * d, 2.0, side) for f in (0.7, 1.2, 1.7)),
              richer=(f"rounded {name}",) + (("two knees", "two rounded") if not side else ()))
          for name, side in sides),
        *(Law(effect="spring-contact", law=f"rounded {name}", subsystem="spring",
              write=w.write_contact_spring,
              knobs=(onset, after, Knob(name="side", unit="-", low=side, high=side, scale=0.0),
                     rounded), starts=((1.2 * d, 2.0, side, 0.3 * d),))
          for name, side in sides),
        Law(effect="spring-contact", law="two knees", subsystem="spring",
            write=w.write_contact_spring, knobs=(onset, after, back), starts=((d, 2.0, d),)),
        Law(effect="spring-contact", law="two rounded", subsystem="spring",
            write=w.write_contact_spring, knobs=(onset, after, back, rounded),
            starts=((d, 2.0, d, 0.3 * d),)),
    ]  # fmt: skip


def _load(case: Case | None, s: Scales) -> list[Law]:
    t = s.load_torque_Nm
    level = Knob(name="coulomb_Nm", unit="Nm", low=0.0, high=20 * t, scale=0.03 * t)
    rise = Knob(name="stribeck_rise", unit="-", low=0.0, high=3.0, scale=0.1, prior=1.0)
    speed = Knob(name="stribeck_velocity_rad_per_s", unit="rad/s", low=5e-3, high=10.0, scale=0.2,
                 log=True, prior=1.2)  # fmt: skip
    pre = Knob(name="presliding_rad", unit="rad", low=1e-5, high=0.05, scale=0.2, log=True,
               prior=1.5)  # fmt: skip
    micro = Knob(name="bristle_damping_Nms_per_rad", unit="Nms/rad", low=0.0, high=20 * t,
                 scale=0.02 * t)  # fmt: skip
    friction = {"effect": "load-friction", "subsystem": "load", "write": w.write_load_friction}
    inertia = (case.rig.load_inertia_kgm2 if case is not None else None) or LIGHT_kgm2
    held = float(np.sqrt(0.1 * t / 1e-3 * inertia))  # half of what keeps bristles from ringing
    v = max(s.speed_rad_per_s, 0.3)
    gravity = any(kind in ("pendulum", "contact") for kind in s.loads)
    found = [
        *([unbalance(t)] if gravity else []),
        Law(law="coulomb", knobs=(level,), starts=tuple((f * t,) for f in (0.02, 0.1, 0.4)),
            richer=("stops", "bristles"), **friction),
        Law(law="stribeck", knobs=(level, rise, speed), starts=((0.1 * t, 0.3, 0.05),),
            richer=("stops", "bristles"), **friction),
        Law(law="presliding", knobs=(level, pre), starts=((0.1 * t, 1e-3),),
            richer=("stops", "bristles"), **friction),
        Law(law="stops", knobs=(level, rise, speed, pre), starts=((0.1 * t, 0.2, 0.05, 1e-3),),
            **friction),
        Law(law="bristles", knobs=(level, rise, speed, replace(pre, name="bristle_rad"), micro),
            starts=tuple((0.1 * t, 0.2, v, 1e-3, d) for v in (0.05, 0.15) for d in (0.1 * t, held)),
            **friction),
        Law(effect="load-drag", law="quadratic", subsystem="load",
            write=w._on_moving_load(e.DRAG, "torque_at_5_rad_per_s_Nm", 1 / 25.0),
            knobs=(Knob(name="torque_at_5_rad_per_s_Nm", unit="Nm", low=0.0,
                        high=100 * t * 25 / v**2, scale=0.05 * t * 25 / v**2),),
            starts=((0.05 * t * 25 / v**2,), (0.3 * t * 25 / v**2,))),
        Law(effect="spring-parallel", law="linear", subsystem="load", write=w.write_parallel,
            knobs=(Knob(name="stiffness_Nm_per_rad", unit="Nm/rad", low=0.0, high=10 * s.stiffness,
                        scale=0.1 * t),
                   Knob(name="rest_angle_rad", unit="rad", low=-1.0, high=1.0, scale=0.02,
                        prior=0.1)),
            starts=((0.3 * t, 0.0), (2.0 * t, 0.0))),
        Law(effect="load-flexibility", law="one mode", subsystem="load", write=w.write_link,
            knobs=(Knob(name="frequency_Hz", unit="Hz", low=1.5, high=120.0, scale=0.03, log=True),
                   Knob(name="tip_share", unit="-", low=0.02, high=0.95, scale=0.05),
                   Knob(name="damping_ratio", unit="-", low=1e-3, high=0.5, scale=0.2, log=True,
                        prior=1.0)),
            starts=tuple((f, 0.4, 0.02) for f in LINK_Hz), grid=LINK_GRID,
            swings=True),
    ]  # fmt: skip
    return found


def _environment() -> list[Law]:
    power = Knob(name="exponent", unit="-", low=1.0, high=3.0, scale=0.05)
    loss = Knob(name="loss_factor_s_per_rad", unit="s/rad", low=0.0, high=5.0, scale=0.1, prior=1.0)
    common = {
        "effect": "contact-nonlinear",
        "subsystem": "environment",
        "write": w.write_contact_law,
    }
    return [
        Law(law="power", knobs=(power,), starts=((1.2,), (1.5,)),
            richer=("hunt-crossley",), **common),
        Law(law="hunt-crossley", knobs=(power, loss), starts=((1.3, 0.2),), **common),
    ]  # fmt: skip


def _sensors(case: Case | None, s: Scales) -> list[Law]:
    found = []
    for column in SENSOR_COLUMNS:
        if column not in s.columns:
            continue
        spread, longest = 1.0, 1.0
        if case is not None:
            spread = max(float(np.std(r[column])) for r in case.identification if column in r)
            longest = max(float(r.time_s[-1] - r.time_s[0]) for r in case.identification)
        spread = max(spread, 1e-9)
        place = f"sensor:{column}"
        change = {"low": -20 * spread, "high": 20 * spread, "scale": 0.005 * spread}
        rate = {key: value / longest for key, value in change.items()}
        if column not in ("motor_angle_rad",):
            found.append(
                Law(effect="sensor-offset", law="constant", subsystem=place, sensor=column,
                    write=w._sensor(column, w._offset),
                    knobs=(Knob(name="offset", unit=column.rsplit("_", 1)[-1], **change),),
                    starts=((0.005 * spread,),))
            )  # fmt: skip
        found += [
            Law(effect="sensor-scale", law="factor", subsystem=place, sensor=column,
                write=w._sensor(column, w._scale),
                knobs=(Knob(name="scale", unit="-", low=0.05, high=20.0, scale=0.01, log=True),),
                starts=((1.02,),)),
            Law(effect="sensor-delay", law="dead time", subsystem=place, sensor=column,
                write=w._sensor(column, w._late),
                knobs=(Knob(name="delay_s", unit="s", low=0.0, high=0.2, scale=0.001),),
                starts=((0.002,), (0.01,))),
            *(Law(effect="sensor-drift", law=name, subsystem=place, sensor=column,
                  write=w._sensor(column, w._drift),
                  knobs=(Knob(name="rate_per_s", unit="1/s", **rate),
                         Knob(name="session", unit="-", low=run, high=run, scale=0.0)),
                  starts=((0.005 * spread / longest, run),))
              for name, run in (("in each recording", 0.0), ("over the session", 1.0))),
        ]  # fmt: skip
    return found


def laws_by_key() -> dict[str, Law]:
    """Every law by key, for reading a model back: starts and scales are of no use there."""
    s = Scales(
        torque_Nm=1.0, motor_torque_Nm=1.0, current_A=1.0, load_torque_Nm=1.0, deflection_rad=0.1,
        stiffness=1.0, speed_rad_per_s=1.0, columns=SENSOR_COLUMNS, loads=("pendulum", "contact"),
    )  # fmt: skip
    laws = [*gear_laws(None, s), *_drive(None, s), *_spring(s, bent=True), *_load(None, s)]
    laws += [
        *laws_to_read(SENSOR_COLUMNS),
        *_environment(),
        *_sensors(None, s),
        disturbance("", 0, (0.0, 1.0, 1.0), 1.0, 1.0),
    ]
    found = {law.key: law for law in laws}
    found |= {
        f"{law.effect}/*": law
        for law in laws
        if law.effect in ("load-flexibility", "load-disturbance")
    }
    found["motor-cogging/*"] = cogging(s, COGGING_CYCLES[:3])
    return found


def disturbance(
    file: str, index: int, start: tuple[float, float, float], torque: float, last_s: float
) -> Law:
    """An outside torque on the load in one recording: (start, width, peak)."""

    def write(v, d, where):
        if where.index == index:
            w.write_pulse(v, d, where)

    return Law(
        effect="load-disturbance", law=f"pulse near {start[0]:.2f} s" if file else "pulse",
        subsystem="load", only=file or None,
        write=write,
        knobs=(Knob(name="start_s", unit="s", low=0.0, high=last_s, scale=0.01),
               Knob(name="width_s", unit="s", low=0.005, high=LONGEST * last_s, scale=0.03,
                    log=True),
               Knob(name="peak_Nm", unit="Nm", low=-50 * torque, high=50 * torque,
                    scale=0.05 * torque),
               Knob(name="taper", unit="-", low=0.0, high=1.0, scale=0.1)),
        starts=((*start, 0.3),),
    )  # fmt: skip


def unbalance(torque: float) -> Law:
    """A gravity torque that the rig does not name."""
    pair = {"unit": "Nm", "low": -100 * torque, "high": 100 * torque, "scale": 0.02 * torque}
    return Law(
        effect="load-unbalance", law="eccentric mass", subsystem="load", write=w.write_unbalance,
        knobs=(Knob(name="sin_Nm", **pair), Knob(name="cos_Nm", **pair)),
        starts=((0.05 * torque, 0.0),),
    )  # fmt: skip
