"""The full plant against MuJoCo and scipy, 10 s of a 1 kHz torque loop on encoder readings.

    python -m benchmarks.full_plant

The plant: the thesis' NLFM (Table 3.1 per deg/s: viscous, arctangent, offset) with a Stribeck
level, load-dependent worm friction, the finite-element curve of AL1 with both knees
(`al1_curve.csv`, the curve of `dftfs study al1`), a dry load joint, a pendulum against a wall,
encoders and the current limit. Under a reference of -4.8 to 16.8 Nm at 0.5 Hz it passes the knee
at 13.4 Nm, leaves the wall and reverses.

What each computes:
  ours     all of it; dry friction set-valued, so that a stuck wheel does not move at all
  LSODA    all of it but the current limit, which is not reached; dry friction tanh(w / 1 mrad/s);
           rtol 1e-6, once per row
  MuJoCo   1 ms, implicitfast: winding with inductance, linear spring, viscous and (soft) Coulomb
           friction of both joints, pendulum, wall as a joint limit, encoders. It has neither
           Stribeck, arctangent and worm friction nor a spring with knees, and computes less

The error is that of the angles against the order-8 engine with located events under the same
commands. Exit status 1 where a target is missed.
"""

import bisect
import math
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from numba import cfunc
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import rsea_core.engines.event_driven.states as k
from benchmarks.timing import interleaved, judged, rms
from rsea_core import ActuatorModel, Inputs, Load, Rig, simulate
from rsea_core.effects import GearLoadFriction, LoadFriction
from rsea_core.effects.friction_presets import nlfm
from rsea_core.engines.fixed_step.layout import CHANNELS
from rsea_core.machine.quantities import count_angle_rad
from rsea_core.machine.spring_table import ANCHOR, C0, UPPER
from rsea_core.model.spring_curve_file import read_spring_curve
from rsea_core.simulation.batch import run_batch

try:
    import mujoco
except ImportError:
    mujoco = None

R, L, K_T, V, N, K_S = 3.78, 4.56e-3, 0.3056, 48.0, 60.0, 65.8
J, B = N**2 * 3.2e-4 + 2.0e-3, N**2 * 1.0e-4 + 0.02
MASS, ARM, J_L, B_L = 2.0, 0.3, 0.2, 0.02
MGD = MASS * 9.80665 * ARM
COUNT = count_angle_rad(8192)
WALL, WALL_STIFFNESS, WALL_DAMPING = 0.05, 200.0, 1.0
COULOMB, RISE, STRIBECK, JOINT = 0.02, 0.5, 4.0, 0.1  # motor side; the joint's own
LEAD, FRICTION = 0.12, 0.05
KP, KI, TICK, TICKS = 0.2, 0.1, 1e-3, 10_000
TIME = np.arange(TICKS + 1) * TICK
TARGET = 6.0 * (1.0 - np.cos(np.pi * TIME)) + 9.0 * np.sin(np.pi * TIME)
SMOOTHED_rad_per_s, LSODA_TICKS = 1e-3, 2000
OVER_MUJOCO, OVER_LSODA, LARGEST_ERROR_rad = 15.0, 500.0, 0.1 * COUNT

SPRING = read_spring_curve(Path(__file__).with_name("al1_curve.csv"))
LOAD = Load(
    kind="contact",
    contact_stiffness_Nm_per_rad=WALL_STIFFNESS,
    contact_angle_rad=WALL,
    contact_damping_Nms_per_rad=WALL_DAMPING,
)


def plant() -> ActuatorModel:
    """The machine with every effect of the module's docstring."""
    rig = replace(Rig.preset("rsea-bench"), load_mass_kg=MASS, load_inertia_kgm2=J_L)
    (smooth,) = nlfm(gear_ratio=N)
    gear = replace(
        smooth, coulomb_Nm=COULOMB, stribeck_rise=RISE, stribeck_velocity_rad_per_s=STRIBECK
    )
    worm = GearLoadFriction(lead_angle_rad=LEAD, friction_coefficient=FRICTION)
    return ActuatorModel(rig, (gear, worm, LoadFriction(coulomb_Nm=JOINT), SPRING))


PLANT = plant()


@cfunc(k.CONTROLLER)
def compiled_pi(parameters, state, signals, command):
    """PI on the torque that the encoders show."""
    deflection = signals[k.READ_MOTOR_ANGLE] / 60.0 - signals[k.READ_LOAD_ANGLE]
    error = signals[k.REFERENCE] - 65.8 * deflection
    state[0] += parameters[1] * error
    command[k.COMMAND] = min(max(parameters[0] * error + state[0], -1.0), 1.0)
    command[k.UNSATURATED] = command[k.COMMAND]


class Pi:
    """The same for the peers."""

    def __init__(self) -> None:
        self.integral = 0.0

    def duty(self, row: int, wheel: float, load: float) -> float:
        motor = math.floor(wheel * N / COUNT) * COUNT
        error = TARGET[row] - K_S * (motor / N - math.floor(load / COUNT) * COUNT)
        self.integral += KI * TICK * error
        return min(max(KP * error + self.integral, -1.0), 1.0)


GAINS = np.array([[KP, KI * TICK]])
REFERENCE = np.column_stack((TARGET, np.zeros((TICKS + 1, 2))))


def product() -> NDArray:
    """Every row by the fixed-step engine, (rows, columns)."""
    return run_batch(
        PLANT, compiled_pi, GAINS, np.zeros(1), time_s=TIME, reference=REFERENCE,
        command_name="duty", load=LOAD, command_limit=1.0, with_rows=True,
    ).rows[0]  # fmt: skip


SMOOTH = PLANT.terms[0]
VISCOUS = B + N**2 * SMOOTH.viscous_Nms_per_rad
REGIONS = [tuple(map(float, row)) for row in SPRING.table().regions]
BREAKS = [row[UPPER] for row in REGIONS[:-1]]
DRIVEN = math.tan(LEAD + math.atan(FRICTION)) / math.tan(LEAD) - 1.0
BACK = 1.0 - math.tan(LEAD - math.atan(FRICTION)) / math.tan(LEAD)


def spring_torque(deflection: float) -> float:
    """The curve, by bisection."""
    row = REGIONS[bisect.bisect_right(BREAKS, deflection)]
    s = deflection - row[ANCHOR]
    return row[C0] + s * (row[C0 + 1] + s * (row[C0 + 2] + s * row[C0 + 3]))


def slope(t: float, y: NDArray, duty: float) -> tuple:
    """Derivatives of the full plant with dry friction smoothed, for scipy."""
    i, wheel, w, load, w_l = y.tolist()
    tau = spring_torque(wheel - load)
    sign = math.tanh(w / SMOOTHED_rad_per_s)
    level = N * COULOMB * (1.0 + RISE * math.exp(-((w * N / STRIBECK) ** 2)))
    level += (DRIVEN if w * tau > 0.0 else BACK) * abs(tau)
    arctan = SMOOTH.arctan_Nm * math.atan(w * N / SMOOTH.arctan_velocity_rad_per_s)
    lost = VISCOUS * w + sign * level + N * (arctan + SMOOTH.offset_Nm)
    joint = JOINT * math.tanh(w_l / SMOOTHED_rad_per_s)
    wall = WALL_STIFFNESS * (load - WALL) + WALL_DAMPING * w_l if load > WALL else 0.0
    return (
        (duty * V - R * i - K_T * N * w) / L,
        w,
        (N * K_T * i - lost - tau) / J,
        w_l,
        (tau - B_L * w_l - MGD * math.sin(load) - wall - joint) / J_L,
    )


def lsoda(ticks: int) -> NDArray:
    """Spring torque by scipy's LSODA, (ticks + 1,)."""
    loop, y, torque = Pi(), np.zeros(5), np.zeros(ticks + 1)
    for row in range(ticks + 1):
        torque[row] = spring_torque(y[1] - y[3])
        held = (loop.duty(row, y[1], y[3]),)
        done = solve_ivp(slope, (0.0, TICK), y, method="LSODA", rtol=1e-6, atol=1e-9, args=held)
        y = done.y[:, -1]
    return torque


STIFF = 'solreffriction="0.002 1" solimpfriction="0.999 0.9999 0.001"'
SPIN = J_L - MASS * ARM**2  # about the centre of mass
MJCF = f"""<mujoco><option timestep="{TICK}" gravity="0 0 -9.80665" integrator="implicitfast">
<flag contact="disable"/></option><compiler angle="radian"/><worldbody>
<body><inertial pos="0 0 0" mass="1" diaginertia="1e-9 1e-9 1e-9"/>
<joint name="wheel" type="hinge" axis="0 -1 0" armature="{J}" damping="{VISCOUS}"
 frictionloss="{N * COULOMB}" {STIFF}/></body>
<body><inertial pos="0 0 -{ARM}" mass="{MASS}" diaginertia="{SPIN} {SPIN} {SPIN}"/>
<joint name="load" type="hinge" axis="0 -1 0" damping="{B_L}" frictionloss="{JOINT}" {STIFF}
 limited="true" range="-10 {WALL}" solreflimit="-{WALL_STIFFNESS / J_L} -{WALL_DAMPING / J_L}"/>
</body></worldbody>
<tendon><fixed name="spring" stiffness="{K_S}" springlength="0">
<joint joint="wheel" coef="1"/><joint joint="load" coef="-1"/></fixed></tendon>
<actuator><dcmotor joint="wheel" gear="{N}" motorconst="{K_T}" resistance="{R}"
 inductance="{L}"/></actuator></mujoco>"""


def peer_mujoco(model, data) -> NDArray:
    """Spring torque by MuJoCo, of what it has of the plant."""
    mujoco.mj_resetData(model, data)
    loop, torque = Pi(), np.zeros(TICKS + 1)
    angles, control = data.qpos, data.ctrl
    for row in range(TICKS + 1):
        wheel, load = angles
        torque[row] = K_S * (wheel - load)
        control[0] = V * loop.duty(row, wheel, load)
        mujoco.mj_step(model, data)
    return torque


def replay_error(rows: NDArray) -> tuple[float, float]:
    """Largest error of wheel and load angle [rad] against the order-8 engine."""
    inputs = Inputs(time_s=TIME, duty=rows[:, -1], load=LOAD)
    exact = simulate(PLANT, inputs)
    wheel = np.abs(rows[:, CHANNELS.index("motor_angle_rad")] - exact.motor_angle_rad).max() / N
    load = np.abs(rows[:, CHANNELS.index("load_angle_rad")] - exact.load_angle_rad).max()
    return float(wheel), float(load)


def bench_full() -> list[bool]:
    """Print times, errors and ratios; which targets are met."""
    model = mujoco.MjModel.from_xml_string(MJCF)
    data = mujoco.MjData(model)
    rows = product()  # compiled
    cpu = time.process_time
    (ours, peer), _ = interleaved(cpu, 7, product, lambda: peer_mujoco(model, data))
    (scipy_s,), (smoothed,) = interleaved(cpu, 1, lambda: lsoda(LSODA_TICKS))
    scipy_s *= TICKS / LSODA_TICKS
    wheel, load = replay_error(rows)
    torque = rows[:, CHANNELS.index("torque_Nm")]
    still = int((np.diff(rows[:, CHANNELS.index("motor_angle_rad")]) == 0.0).sum())
    apart = rms(smoothed - torque[: LSODA_TICKS + 1])
    print("full plant, CPU time for 10 s (MuJoCo computes less, see the module's docstring):")
    print(f"  fixed-step engine        {ours * 1e3:9.3f} ms  wheel exactly still in {still} rows,")
    print(f"                     torque {torque.min():.1f} to {torque.max():.1f} Nm,", end=" ")
    print(f"angles within {wheel:.2g} and {load:.2g} rad of the order-8 engine")
    print(f"  MuJoCo 1 ms        {peer * 1e3:9.3f} ms")
    part = f"{LSODA_TICKS * TICK:g} s, time scaled; {apart:.2g} Nm rms apart"
    print(f"  scipy LSODA        {scipy_s * 1e3:9.0f} ms  ({part})")
    return [
        still > 0,
        max(wheel, load) < LARGEST_ERROR_rad,
        judged("x MuJoCo", peer / ours, OVER_MUJOCO),
        judged("x LSODA", scipy_s / ours, OVER_LSODA),
    ]


if __name__ == "__main__":
    if mujoco is None:
        sys.exit("MuJoCo is not installed (pip install mujoco): its targets cannot be shown")
    sys.exit(0 if all(bench_full()) else 1)
