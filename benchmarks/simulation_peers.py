"""Bench B1 against MuJoCo and scipy in one process: time ratios and torque error.

    python benchmarks/simulation_peers.py

10 s of a 1 kHz PI torque loop (2 Nm at 0.5 Hz, exact states) on motor, gear 60, spring
65.8 Nm/rad and a 2 kg pendulum, with 2.5 Nm of Coulomb friction on the wheel. The reference is
scipy's DOP853 (rtol 1e-10) with located stick and slip, written here apart from the product.
MuJoCo: `dcmotor` with inductance, 1 ms, stiff frictionloss. LSODA: rtol 1e-6, friction
tanh(w / 1 mrad/s). Times are CPU seconds, best of the repeats. Exit status 1 where a target is
missed.
"""

import sys
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numba import cfunc
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import rsea_core.kernel as k
from rsea_core import ActuatorModel, GearFriction, Load, Rig
from rsea_core.simulate import run_sampled

try:
    import mujoco
except ImportError:
    mujoco = None

R, L, K_T, V, N, K_S = 3.78, 4.56e-3, 0.3056, 48.0, 60.0, 65.8
J, B = N**2 * 3.2e-4 + 2.0e-3, N**2 * 1.0e-4 + 0.02
MASS, ARM, J_L, B_L = 2.0, 0.3, 0.2, 0.02
SPIN = J_L - MASS * ARM**2  # about the centre of mass
MGD = MASS * 9.80665 * ARM
COULOMB = 2.5
KP, KI, TICK, TICKS = 0.2, 1.0, 1e-3, 10_000
TIME = np.arange(TICKS + 1) * TICK
TARGET = 2.0 * np.sin(2.0 * np.pi * 0.5 * TIME)
OVER_MUJOCO, OVER_LSODA, LARGEST_ERROR_Nm = 50.0, 1500.0, 1e-5
SMOOTHED_rad_per_s = 1e-3


@cfunc(k.CONTROLLER)
def compiled_pi(parameters, state, signals, command):
    """The loop's law for the product."""
    error = signals[k.REFERENCE] - signals[k.TRUE_TORQUE]
    state[0] += parameters[1] * error
    command[k.COMMAND] = min(max(parameters[0] * error + state[0], -1.0), 1.0)
    command[k.UNSATURATED] = command[k.COMMAND]


class Pi:
    """The loop's law for the peers."""

    def __init__(self) -> None:
        self.integral = 0.0

    def duty(self, row: int, torque: float) -> float:
        error = TARGET[row] - torque
        self.integral += KI * TICK * error
        return min(max(KP * error + self.integral, -1.0), 1.0)


def product(step_s: float | None) -> NDArray:
    """Spring torque by rsea_core."""
    rig = replace(
        Rig.preset("rsea-bench"), load_mass_kg=MASS, load_inertia_kgm2=J_L, current_limit_A=None
    )
    result = run_sampled(
        ActuatorModel(rig, (GearFriction(coulomb_Nm=COULOMB / N),)),
        command_name="duty",
        load=Load(),
        time_s=TIME,
        controller=compiled_pi,
        parameters=np.array([KP, KI * TICK]),
        state=np.zeros(1),
        reference=np.column_stack((TARGET, np.zeros((TICKS + 1, 2)))),
        command_limit=1.0,
        step_s=step_s,
    )
    return result.torque_Nm


def slope(t: float, y: NDArray, duty: float, friction: Callable, way: float) -> tuple:
    """Derivatives of the bench; friction(w, way) is what resists the wheel."""
    i, wheel, w, load, w_l = y
    tau = K_S * (wheel - load)
    accelerated = (N * K_T * i - B * w - tau - friction(w, way)) / J
    return (
        (duty * V - R * i - K_T * N * w) / L,
        w,
        accelerated,
        w_l,
        (tau - B_L * w_l - MGD * np.sin(load)) / J_L,
    )


def lsoda(ticks: int) -> NDArray:
    """Spring torque by scipy's LSODA, friction smoothed."""

    def friction(w: float, way: float) -> float:
        return COULOMB * np.tanh(w / SMOOTHED_rad_per_s)

    loop, y, torque = Pi(), np.zeros(5), np.zeros(ticks + 1)
    for row in range(ticks + 1):
        torque[row] = K_S * (y[1] - y[3])
        held = (loop.duty(row, torque[row]), friction, 0.0)
        done = solve_ivp(slope, (0.0, TICK), y, method="LSODA", rtol=1e-6, atol=1e-9, args=held)
        y = done.y[:, -1]
    return torque


def reference() -> NDArray:
    """Spring torque by DOP853 with events; a stuck wheel does not move."""

    def push(y: NDArray) -> float:
        return N * K_T * y[0] - K_S * (y[1] - y[3])

    def sliding(w: float, way: float) -> float:
        return way * COULOMB

    def stuck_slope(t: float, y: NDArray, duty: float, friction: Callable, way: float) -> tuple:
        i, _, _, a, b = slope(t, y, duty, friction, way)
        return i, 0.0, 0.0, a, b

    def breakaway(t: float, y: NDArray, *held: object) -> float:
        return abs(push(y)) - COULOMB

    def stop(t: float, y: NDArray, duty: float, friction: Callable, way: float) -> float:
        return way * y[2]

    breakaway.terminal, breakaway.direction = True, 1.0
    stop.terminal, stop.direction = True, -1.0
    loop, y, torque, way = Pi(), np.zeros(5), np.zeros(TICKS + 1), 0.0
    for row in range(TICKS + 1):
        torque[row] = K_S * (y[1] - y[3])
        duty, t, going = loop.duty(row, torque[row]), 0.0, True
        while going and t < TICK:
            law, event = (slope, stop) if way else (stuck_slope, breakaway)
            done = solve_ivp(
                law,
                (t, TICK),
                y,
                method="DOP853",
                rtol=1e-10,
                atol=1e-12,
                args=(duty, sliding, way),
                events=event,
            )
            t, y, going = done.t[-1], done.y[:, -1].copy(), done.status == 1
            if going:
                y[2] = 0.0
                way = 0.0 if way and abs(push(y)) <= COULOMB else float(np.sign(push(y)))
    return torque


MJCF = f"""<mujoco><option timestep="{TICK}" gravity="0 0 -9.80665" integrator="implicitfast">
<flag contact="disable"/></option><worldbody>
<body><inertial pos="0 0 0" mass="1" diaginertia="1e-9 1e-9 1e-9"/>
<joint name="wheel" type="hinge" axis="0 -1 0" armature="{J}" damping="{B}"
 frictionloss="{COULOMB}" solreffriction="0.002 1" solimpfriction="0.999 0.9999 0.001"/></body>
<body><inertial pos="0 0 -{ARM}" mass="{MASS}" diaginertia="{SPIN} {SPIN} {SPIN}"/>
<joint name="load" type="hinge" axis="0 -1 0" damping="{B_L}"/></body></worldbody>
<tendon><fixed name="spring" stiffness="{K_S}" springlength="0">
<joint joint="wheel" coef="1"/><joint joint="load" coef="-1"/></fixed></tendon>
<actuator><dcmotor joint="wheel" gear="{N}" motorconst="{K_T}" resistance="{R}"
 inductance="{L}"/></actuator></mujoco>"""


def peer_mujoco() -> NDArray:
    """Spring torque by MuJoCo."""
    model = mujoco.MjModel.from_xml_string(MJCF)
    data, loop, torque = mujoco.MjData(model), Pi(), np.zeros(TICKS + 1)
    angles, control = data.qpos, data.ctrl
    for row in range(TICKS + 1):
        torque[row] = K_S * (angles[0] - angles[1])
        control[0] = V * loop.duty(row, torque[row])
        mujoco.mj_step(model, data)
    return torque


def timed(run: Callable[[], NDArray], repeats: int) -> tuple[float, NDArray]:
    """Best CPU time of the repeats [s], and the result."""
    best, result = np.inf, np.zeros(0)
    for _ in range(repeats):
        start = time.process_time()
        result = run()
        best = min(best, time.process_time() - start)
    return best, result


def rms(difference: NDArray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(difference**2)))


def main() -> int:
    """Run all, print the table, say which targets are met."""
    exact = reference()
    product(None)  # compile
    seconds, torque = timed(lambda: product(None), 9)
    error = rms(torque - exact)
    print(f"rsea_core   {seconds * 1e3:9.2f} ms   torque error {error:.2g} Nm")
    at_tick, coarse = timed(lambda: product(TICK), 9)
    print(f"  step 1 ms {at_tick * 1e3:9.2f} ms   torque error {rms(coarse - exact):.2g} Nm")
    met = [error <= LARGEST_ERROR_Nm]
    share = 1000
    lsoda_s, smoothed = timed(lambda: lsoda(share), 1)
    lsoda_s *= TICKS / share
    off = rms(smoothed - exact[: share + 1])
    print(f"scipy LSODA {lsoda_s * 1e3:9.1f} ms   torque error {off:.2g} Nm (1 s, time x 10)")
    met.append(lsoda_s / seconds >= OVER_LSODA)
    print(f"  {lsoda_s / seconds:.0f} x rsea_core's time; target {OVER_LSODA:.0f}")
    if mujoco is None:
        print("MuJoCo is not installed: that comparison is left out, its target not shown")
        met.append(False)
    else:
        peer_s, found = timed(peer_mujoco, 5)
        print(f"MuJoCo      {peer_s * 1e3:9.1f} ms   torque error {rms(found - exact):.2g} Nm")
        met.append(peer_s / seconds >= OVER_MUJOCO)
        print(f"  {peer_s / seconds:.1f} x rsea_core's time; target {OVER_MUJOCO:.0f}")
    print(f"torque error target {LARGEST_ERROR_Nm:g} Nm: {'met' if met[0] else 'missed'}")
    print("all targets met" if all(met) else "a target is missed")
    return 0 if all(met) else 1


if __name__ == "__main__":
    sys.exit(main())
