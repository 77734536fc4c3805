"""Error and order of the fixed-step engine, each effect alone and all together, by step halving.

    python benchmarks/step_halving.py [part of an effect's name]

The bench rig follows a duty of several tones for 10 s. The reference is the engine itself at
1/128 of the default step. Exits with 1 where the default step's error is above a tenth of an
encoder count in either angle.
"""

import math
import sys

import numpy as np

import rsea_core.effects.layout as e
from rsea_core import ActuatorModel, Inputs, Load, Rig
from rsea_core.engines.fixed_step.replay import Replay
from rsea_core.engines.fixed_step.step_length import longest_step_s
from rsea_core.machine.quantities import count_angle_rad

ROW_s, DURATION_s, FINER = 1e-3, 10.0, 32
GEAR = {"wheel_dry": 1.0, "gear_coulomb_forward": 2.4, "gear_coulomb_backward": 2.0}
LOAD = {"load_dry": 1.0, "load_coulomb": 0.08}
EFFECTS = {
    "nominal": {},
    "gear-friction": GEAR,
    "gear-friction, Stribeck": GEAR | {"gear_stribeck_rise": 0.4, "gear_stribeck_velocity": 0.1},
    "gear-friction, presliding": {**GEAR, "wheel_dry": 0.0, "gear_presliding": 5e-4},
    "gear-friction, arctangent": {
        "gear_atan_level": 1.3, "gear_atan_velocity": 0.02, "gear_offset": 0.2
    },
    "gear-load-friction": {"wheel_dry": 1.0, "gear_drive_loss": 0.9, "gear_backdrive_loss": 1.1},
    "gear-backlash": {"backlash_width": 4e-3, "backlash_wheel_inertia": 2e-3,
                      "backlash_wheel_damping": 0.02},
    "gear-transmission-error": {"wheel_error": 2e-3, "worm_error": 3e-4},
    "motor-cogging": {"cogging_torque": 0.6, "cogging_cycles_at_output": 720.0},
    "motor-ripple": {"ripple_fraction": 0.05, "ripple_cycles_at_output": 360.0},
    "drive-dead-zone": {"dead_zone": 0.03},
    "drive-dead-zone, dead time": {"dead_time_duty": 0.01, "dead_time_current": 0.05},
    "drive-saturation": {"source_resistance": 0.5},
    "drive-delay": {"command_delay": 2.3e-3},
    "drive-thermal": {
        "winding_heat_capacity": 5.0, "winding_to_case": 0.5, "case_heat_capacity": 50.0,
        "case_to_ambient": 0.3, "resistance_rise": 3.9e-3, "torque_constant_fall": 1e-3,
    },
    "spring-hysteresis, Maxwell slip": {
        "slip_stiffness_1": 20.0, "slip_yield_1": 3e-3, "slip_stiffness_2": 10.0,
        "slip_yield_2": 1e-2,
    },
    "spring-hysteresis, Bouc-Wen": {
        "bouc_wen_stiffness": 20.0, "bouc_wen_yield": 5e-3, "bouc_wen_exponent": 1.5,
        "bouc_wen_shape": 0.6,
    },
    "spring-viscoelastic": {
        "spring_damping": 0.05, "branch_stiffness_1": 15.0, "branch_time_1": 0.05,
        "branch_stiffness_2": 8.0, "branch_time_2": 1.0,
    },
    "spring-parallel": {"parallel_stiffness": 2.0},
    "load-friction": LOAD,
    "load-friction, presliding": {"load_coulomb": 0.08, "load_presliding": 2e-3},
    "load-friction, Stribeck and bearing load": LOAD | {
        "load_stribeck_rise": 0.5, "load_stribeck_velocity": 0.1, "load_normal_friction": 0.02,
        "load_weight": 2.94, "load_mass_lever": 0.09,
    },
    "load-drag": {"load_drag": 0.05},
    "load-unbalance": {"unbalance_torque": 0.2, "unbalance_angle": 1.0},
    "load-position-torque": {
        "position_first": -0.4, "position_step": 0.8 / 31,
        **{f"position_torque_{j}": 0.15 * math.cos(0.85 * j) for j in range(1, 33)},
    },
    "load-disturbance": {"pulse_torque": 1.0, "pulse_start": 3.00037, "pulse_end": 3.5004},
    "load-flexibility": {"link_stiffness": 60.0, "link_inertia": 0.012, "link_damping": 0.01},
    "contact": {},
    "contact-nonlinear": {
        "contact_exponent": 1.5, "contact_reference_depth": 0.05, "contact_loss_factor": 0.2
    },
}  # fmt: skip
CONTACT = Load(
    kind="contact",
    contact_stiffness_Nm_per_rad=300.0,
    contact_angle_rad=0.05,
    contact_damping_Nms_per_rad=0.5,
)
LIMIT_rad = 0.1 * count_angle_rad(8192)


def duty(time: np.ndarray) -> np.ndarray:
    """A few tones that reverse all joints and reach the contact."""
    tones = ((0.12, 0.7), (0.08, 1.9), (0.05, 5.3))
    return np.round(sum(a * np.sin(2.0 * np.pi * f * time) for a, f in tones), 2)


def replay_of(effects: str, step_s: float | None = None) -> Replay:
    """The replay of one case at a step."""
    load = CONTACT if effects.startswith(("contact", "everything")) else Load()
    time = np.arange(0.0, DURATION_s, ROW_s)
    return Replay.of(Inputs(time_s=time, duty=duty(time), load=load), step_s=step_s)


def everything() -> dict[str, float]:
    """Every effect at once; of exclusive laws the later ones."""
    found = {}
    for numbers in EFFECTS.values():
        found |= numbers
    return found | {"wheel_dry": 1.0, "load_dry": 1.0}


def numbers_of(replay: Replay, fx: dict[str, float]):
    """The bench rig's numbers with these effects."""
    numbers = replay.numbers(ActuatorModel(Rig.preset("rsea-bench")))
    array = numbers.fx.copy()
    for name, value in ({"any": 1.0} | fx).items() if fx else ():
        array[e.EFFECTS.index(name)] = value
    if "link_inertia" in fx:
        inner = numbers.plant[10] - fx["link_inertia"]
        numbers = numbers.with_plant(load_inertia=inner)
    return numbers._replace(fx=array)


def errors(name: str, fx: dict[str, float], steps: list[float]) -> np.ndarray:
    """Largest error of either angle [rad] and RMS error of the torque [Nm] at each step."""
    reference = replay_of(name, min(steps) / FINER)
    numbers = numbers_of(reference, fx)
    exact = reference.run(numbers)
    found = []
    for step in steps:
        rows = replay_of(name, step).run(numbers)
        wheel = np.abs(rows[:, 0] - exact[:, 0]).max() / numbers.plant[19]
        torque = float(np.sqrt(np.mean((rows[:, 2] - exact[:, 2]) ** 2)))
        found.append((wheel, np.abs(rows[:, 1] - exact[:, 1]).max(), torque))
    return np.array(found)


def main() -> int:
    """Print the table; 1 where a default step is too coarse."""
    print(f"limit {LIMIT_rad:.3g} rad; default step, its error, order over two halvings")
    print(f"{'effect':42} step ms  wheel rad  load rad  order  torque RMS Nm")
    bad = []
    chosen = sys.argv[1:]
    for name, fx in {**EFFECTS, "everything": everything()}.items():
        if chosen and not any(part in name for part in chosen):
            continue
        replay = replay_of(name)
        numbers = numbers_of(replay, fx)
        step = float(longest_step_s(*numbers))
        found = errors(name, fx, [step, step / 2.0, step / 4.0])
        both = found[:, :2].max(axis=1)
        order = np.log2(both[0] / both[2]) / 2.0
        print(
            f"{name:42} {step * 1e3:7.3f}  {found[0, 0]:9.2e} {found[0, 1]:9.2e}"
            f"  {order:5.2f}  {found[0, 2]:9.2e}",
            flush=True,
        )
        if not both[0] < LIMIT_rad:
            bad.append(name)
    if bad:
        print(f"above a tenth of a count: {', '.join(bad)}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
