"""The laws of motor, gear and worm that a diagnosis tries."""

from dataclasses import replace

import numpy as np

import rsea_core.identify.candidates.writers as w
from rsea_core.identify.candidates.candidate import Knob, Law
from rsea_core.identify.candidates.rig_parameters import TOLERANCES
from rsea_core.identify.candidates.typical_magnitudes import Scales
from rsea_core.machine.rig import Rig

WHEEL_ERROR_rad, WORM_ERROR_rad = 6e-3, 3e-3  # transmission errors at the wheel, as priors: over
# a small angle a large one would be an offset or a stiffness
COGGING_CYCLES = tuple(range(1, 49))
WHEEL_kgm2, LEAST_DRAG = 2e-3, 1e-4  # of a wheel of which the rig's file says nothing [Nms/rad]
MOTOR_kgm2 = 1e-4  # of a motor, likewise
REBOUND = 0.3  # of flanks of steel and bronze in grease, before a fit says more
# widths over the deflection, a tenth apart: beyond that free runs meet the flanks out of step
PLAY_GRID, REBOUNDS = np.geomspace(0.01, 1.5, 54), (0.1, 0.4, 0.7)


def gear_laws(rig: Rig | None, s: Scales) -> list[Law]:
    level = Knob(
        name="coulomb_Nm", unit="Nm", low=0.0, high=20 * s.motor_torque_Nm,
        scale=0.05 * s.motor_torque_Nm,
    )  # fmt: skip
    levels = [share * s.motor_torque_Nm for share in (0.02, 0.08, 0.25)]
    rise = Knob(name="stribeck_rise", unit="-", low=0.0, high=3.0, scale=0.1, prior=1.0)
    speed = Knob(
        name="stribeck_velocity_rad_per_s", unit="rad/s", low=0.05, high=100.0, scale=0.2, log=True,
        prior=1.2,
    )  # fmt: skip
    pre = Knob(
        name="presliding_rad", unit="rad", low=1e-4, high=0.5, scale=0.2, log=True, prior=1.5
    )
    bristle = replace(pre, name="bristle_rad")
    inertia = (rig.motor_inertia_kgm2 if rig is not None else None) or MOTOR_kgm2
    damped = float(np.sqrt(inertia * levels[1] / 0.02))  # half the critical damping, as in LuGre's
    micro = Knob(name="bristle_damping_Nms_per_rad", unit="Nms/rad", low=0.0, high=100 * damped,
                 scale=0.2 * damped)  # fmt: skip
    skew = Knob(name="asymmetry", unit="-", low=-0.9, high=0.9, scale=0.05, prior=0.3)
    lean = replace(skew, name="viscous_asymmetry")  # of the viscous friction
    friction = {"effect": "gear-friction", "subsystem": "gear", "write": w.write_gear_friction}
    amplitude = 0.3 * s.deflection_rad
    phase_pair = {"scale": 0.02 * s.deflection_rad, "low": -amplitude, "high": amplitude}
    wheel, worm, second, third = (), (), (), ()
    for part, prior in (("wheel", WHEEL_ERROR_rad), ("worm", WORM_ERROR_rad)):
        knobs = [
            Knob(name=f"{part}_{p}_{w}rad", unit="rad", prior=size, **phase_pair)
            for w, size in (("", prior), ("2_", 0.5 * prior), ("3_", 0.3 * prior))
            for p in ("sin", "cos")
        ]  # fmt: skip
        wheel, worm = (knobs[:2], worm) if part == "wheel" else (wheel, knobs[:2])
        second += tuple(knobs[2:4])
        third = tuple(knobs[4:])  # of the worm: many turns in a recording; the wheel's is a bend
    small = 0.03 * s.deflection_rad
    te = {
        "effect": "gear-transmission-error",
        "subsystem": "gear",
        "write": w.write_transmission_error,
    }
    found = [
        Law(law="coulomb", knobs=(level,), starts=tuple((v,) for v in levels),
            richer=("asymmetric", "stops", "bristles"), **friction),
        Law(law="presliding", knobs=(level, pre), starts=((levels[1], 0.02),), **friction,
            richer=("stops", "bristles", "asymmetric presliding")),
        Law(law="asymmetric presliding", knobs=(level, skew, pre),
            starts=((levels[1], 0.0, 0.02),),
            richer=("stops", "bristles", "direction-dependent presliding"), **friction),
        Law(law="stribeck", knobs=(level, rise, speed), starts=((levels[1], 0.3, 2.0),),
            richer=("stops", "bristles"), **friction),
        Law(law="stribeck presliding", knobs=(level, rise, speed, pre),
            starts=((levels[1], 0.2, 2.0, 0.02),), richer=("stops", "bristles"), **friction),
        Law(law="asymmetric", knobs=(level, skew), starts=((levels[1], 0.0),),
            richer=("stops", "bristles", "direction-dependent", "asymmetric presliding"),
            **friction),
        Law(law="direction-dependent", knobs=(level, skew, lean),
            starts=((levels[1], 0.0, 0.0),), richer=("direction-dependent presliding",),
            **friction),
        Law(law="direction-dependent presliding", knobs=(level, skew, lean, pre),
            starts=((levels[1], 0.0, 0.0, 0.02),), **friction),
        Law(law="stops", knobs=(level, rise, speed, pre, skew),
            starts=((levels[1], 0.2, 2.0, 0.02, 0.0),), **friction),
        Law(law="bristles", knobs=(level, rise, speed, bristle, skew, micro),
            starts=((levels[1], 0.2, 2.0, 0.02, 0.0, damped),), **friction),
        *_plays(rig, s),
        Law(law="wheel", knobs=wheel, starts=((small, 0.0),), **te,
            richer=("wheel and worm", "two harmonics")),
        Law(law="worm", knobs=worm, starts=((small, 0.0),), **te,
            richer=("wheel and worm", "two harmonics")),
        Law(law="wheel and worm", knobs=(*wheel, *worm), starts=((small, 0.0, small, 0.0),), **te,
            richer=("two harmonics", "three harmonics")),
        Law(law="two harmonics", knobs=(*wheel, *worm, *second),
            starts=((small, 0.0, small, 0.0, *(0.1 * small,) * 4),),
            richer=("three harmonics",), **te),
        Law(law="three harmonics", knobs=(*wheel, *worm, *second, *third),
            starts=((small, 0.0, small, 0.0, *(0.1 * small,) * 4, *(0.05 * small,) * 2),), **te),
    ]  # fmt: skip
    share = {"unit": "-", "scale": 0.03}
    efficiencies = (
        Knob(name="drive_efficiency", low=0.05, high=1.0, **share),
        Knob(name="backdrive_efficiency", low=-3.0, high=1.0, **share),
    )
    found.append(
        Law(effect="gear-load-friction", law="efficiencies", subsystem="gear",
            write=w.write_gear_efficiency,
            knobs=efficiencies, starts=((0.97, 0.97), (0.85, 0.8), (0.6, 0.3)),
            richer=("efficiencies, bristles",))
    )  # fmt: skip
    found.append(
        Law(effect="gear-load-friction", law="efficiencies, bristles", subsystem="gear",
            write=w.write_gear_efficiency, knobs=(*efficiencies, bristle),
            starts=((0.85, 0.8, 0.02),), always=("efficiencies, fading",))
    )  # fmt: skip
    found.append(
        Law(effect="gear-load-friction", law="efficiencies, fading", subsystem="gear",
            write=w.write_gear_efficiency, knobs=(*efficiencies, bristle, rise, speed),
            starts=((0.85, 0.8, 0.02, 0.1, 10.0),))
    )  # fmt: skip
    found += [cogging(s, (c,)) for c in COGGING_CYCLES]
    return found


def _plays(rig: Rig | None, s: Scales) -> list[Law]:
    """Play, the wheel behind it as the rig has it, or free: it swings on the spring and bounces."""
    width = Knob(name="width_rad", unit="rad", low=0.0, high=s.deflection_rad * 4 + 0.02,
                 scale=0.02 * s.deflection_rad)  # fmt: skip
    inertia = (rig.output_inertia_kgm2 if rig is not None else None) or WHEEL_kgm2
    damping = max((rig.output_viscous_Nms_per_rad if rig is not None else None) or 0.0, LEAST_DRAG)
    wheel = (
        Knob(name="wheel_inertia_kgm2", unit="kgm2", low=0.2 * inertia, high=5.0 * inertia,
             scale=0.1, log=True, prior=TOLERANCES["output_inertia_kgm2"]),
        Knob(name="wheel_damping_Nms_per_rad", unit="Nms/rad", low=0.02 * damping,
             high=50.0 * damping, scale=0.2, log=True,
             prior=TOLERANCES["output_viscous_Nms_per_rad"]),
        Knob(name="rebound", unit="-", low=0.0, high=0.95, scale=0.1),
    )  # fmt: skip
    held = tuple(replace(knob, scale=0.0) for knob in wheel)
    common = {"effect": "gear-backlash", "subsystem": "gear", "write": w.write_backlash}
    starts = tuple((v * s.deflection_rad, inertia, damping, REBOUND) for v in (0.01, 0.04, 0.15))
    grid = tuple(
        (float(v) * s.deflection_rad, inertia, damping, rebound)
        for rebound in REBOUNDS for v in PLAY_GRID
    )  # fmt: skip
    return [
        Law(law="play", knobs=(width, *held), starts=starts, richer=("play, wheel",), **common),
        Law(law="play, wheel", knobs=(width, *wheel), starts=starts, grid=grid, **common),
    ]


def cogging(s: Scales, cycles: tuple[int, ...]) -> Law:
    """A torque over the motor's angle of one wave or a few, by their cycles in a turn."""
    ripple = 0.05 * s.motor_torque_Nm
    knobs, start = [], []
    for wave, c in zip(("", "2_", "3_"), cycles, strict=False):
        knobs += [
            Knob(name=f"{p}_{wave}Nm", unit="Nm", low=-20 * ripple, high=20 * ripple,
                 scale=0.2 * ripple) for p in ("sin", "cos")
        ]  # fmt: skip
        knobs.append(Knob(name=f"cycles_{wave}per_rev", unit="-", low=c, high=c, scale=0.0))
        start += [0.1 * ripple, 0.0, float(c)]
    return Law(
        effect="motor-cogging", law=f"{'+'.join(map(str, cycles))} per turn", subsystem="gear",
        write=w.write_cogging, knobs=tuple(knobs), starts=(tuple(start),),
    )  # fmt: skip
