"""Peers in one process: time ratios and errors of bench B1 and a batch, then of the full plant.

    python -m benchmarks.simulation_peers

B1: 10 s of a 1 kHz PI torque loop (2 Nm at 0.5 Hz, exact states) on motor, gear 60, spring
65.8 Nm/rad and a 2 kg pendulum, with 2.5 Nm of Coulomb friction on the wheel. The reference is
scipy's DOP853 (rtol 1e-10) with located stick and slip, written here apart from the product.
MuJoCo: `dcmotor` with inductance, 1 ms, implicitfast, stiff frictionloss, contact off. LSODA:
rtol 1e-6, friction tanh(w / 1 mrad/s). The batch is a sweep of 1000 gains. The full plant is
that of `benchmarks.full_plant`. Best of interleaved rounds; CPU or wall time as stated. Exit
status 1 where a target is missed.
"""

import sys
import time
from collections.abc import Callable
from dataclasses import replace

import numba
import numpy as np
from numba import cfunc
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import rsea_core.engines.event_driven.states as k
from benchmarks.full_plant import bench_full
from benchmarks.timing import interleaved, judged, rms
from rsea_core import ActuatorModel, Load, Rig
from rsea_core.effects import GearFriction
from rsea_core.simulation.batch import run_batch
from rsea_core.simulation.simulate import run_sampled

try:
    import mujoco
    from mujoco import rollout
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
BATCH_OVER_MUJOCO = 30.0
SMOOTHED_rad_per_s = 1e-3
RUNS, PEER_RUNS, THREADS = 1000, 10, 2


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


def bench(*terms: object) -> ActuatorModel:
    """The bench; its controller reads exact states, so encoders are left out."""
    rig = replace(
        Rig.preset("rsea-bench"),
        load_mass_kg=MASS,
        load_inertia_kgm2=J_L,
        current_limit_A=None,
        motor_encoder_counts_per_rev=None,
        load_encoder_counts_per_rev=None,
    )
    return ActuatorModel(rig, terms)


DRY = GearFriction(coulomb_Nm=COULOMB / N)
MODEL = bench(DRY)
GAINS = np.array([KP, KI * TICK])
LOOP = {
    "time_s": TIME,
    "controller": compiled_pi,
    "reference": np.column_stack((TARGET, np.zeros((TICKS + 1, 2)))),
    "command_limit": 1.0,
}


def ran(engine: str | None = None, model: ActuatorModel = MODEL):
    """The loop as `simulate_closed_loop` runs it; a model that has run keeps its matrices."""
    return run_sampled(
        model, command_name="duty", load=Load(), parameters=GAINS, state=np.zeros(1),
        engine=engine, **LOOP,
    )  # fmt: skip


def product() -> NDArray:
    """Spring torque by the engine that is chosen."""
    return ran().torque_Nm


def integrator() -> NDArray:
    """Spring torque by the order-8 integrator with its energy ledger."""
    return ran("event-driven").torque_Nm


def with_energies() -> NDArray:
    """Spring torque by the engine that is chosen, and where the energy went."""
    found = ran()
    return found.torque_Nm if found.energy is not None else np.zeros(0)


def batch(threads: int) -> NDArray:
    """rms errors of RUNS gains by `run_batch`."""
    numba.set_num_threads(min(threads, numba.config.NUMBA_NUM_THREADS))
    gains = np.column_stack((np.linspace(0.05, 0.3, RUNS), np.full(RUNS, KI * TICK)))
    found = run_batch(
        MODEL, parameters=gains, state=np.zeros(1), command_name="duty", load=Load(), **LOOP
    )
    return found.metric("rmse")


def slope(t: float, y: NDArray, duty: float, friction: Callable, motion: float) -> tuple:
    """Derivatives of the bench; friction(w, way) is what resists the wheel."""
    i, wheel, w, load, w_l = y
    tau = K_S * (wheel - load)
    accelerated = (N * K_T * i - B * w - tau - friction(w, motion)) / J
    return (
        (duty * V - R * i - K_T * N * w) / L,
        w,
        accelerated,
        w_l,
        (tau - B_L * w_l - MGD * np.sin(load)) / J_L,
    )


def lsoda(ticks: int) -> NDArray:
    """Spring torque by scipy's LSODA, friction smoothed."""

    def friction(w: float, motion: float) -> float:
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

    def applied_torque(y: NDArray) -> float:
        return N * K_T * y[0] - K_S * (y[1] - y[3])

    def sliding(w: float, motion: float) -> float:
        return motion * COULOMB

    def stuck_slope(t: float, y: NDArray, duty: float, friction: Callable, motion: float) -> tuple:
        i, _, _, a, b = slope(t, y, duty, friction, motion)
        return i, 0.0, 0.0, a, b

    def breakaway(t: float, y: NDArray, *held: object) -> float:
        return abs(applied_torque(y)) - COULOMB

    def stop(t: float, y: NDArray, duty: float, friction: Callable, motion: float) -> float:
        return motion * y[2]

    breakaway.terminal, breakaway.direction = True, 1.0
    stop.terminal, stop.direction = True, -1.0
    loop, y, torque, motion = Pi(), np.zeros(5), np.zeros(TICKS + 1), 0.0
    for row in range(TICKS + 1):
        torque[row] = K_S * (y[1] - y[3])
        duty, t, going = loop.duty(row, torque[row]), 0.0, True
        while going and t < TICK:
            law, event = (slope, stop) if motion else (stuck_slope, breakaway)
            done = solve_ivp(
                law,
                (t, TICK),
                y,
                method="DOP853",
                rtol=1e-10,
                atol=1e-12,
                args=(duty, sliding, motion),
                events=event,
            )
            t, y, going = done.t[-1], done.y[:, -1].copy(), done.status == 1
            if going:
                y[2] = 0.0
                motion = (
                    0.0
                    if motion and abs(applied_torque(y)) <= COULOMB
                    else float(np.sign(applied_torque(y)))
                )
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


def loaded(text: str = MJCF):
    """MuJoCo's model and data."""
    model = mujoco.MjModel.from_xml_string(text)
    return model, mujoco.MjData(model)


def peer_mujoco(model, data) -> NDArray:
    """Spring torque by MuJoCo."""
    mujoco.mj_resetData(model, data)
    loop, torque = Pi(), np.zeros(TICKS + 1)
    angles, control = data.qpos, data.ctrl
    for row in range(TICKS + 1):
        torque[row] = K_S * (angles[0] - angles[1])
        control[0] = V * loop.duty(row, torque[row])
        mujoco.mj_step(model, data)
    return torque


def peer_batch(model) -> None:
    """PEER_RUNS open-loop runs by mujoco.rollout on THREADS threads."""
    data = [mujoco.MjData(model) for _ in range(THREADS)]
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.zeros((PEER_RUNS, mujoco.mj_stateSize(model, kind)))
    control = np.tile(0.2 * V * np.sin(np.pi * TIME[:-1])[None, :, None], (PEER_RUNS, 1, 1))
    with rollout.Rollout(nthread=THREADS) as pool:
        pool.rollout([model] * PEER_RUNS, data, start, control)


def bench_b1(model, data) -> list[bool]:
    """Coulomb friction, linear spring."""
    exact = reference()
    product(), integrator(), peer_mujoco(model, data)  # compiled, loaded
    cpu = time.process_time
    (ours, slow, whole, peer), (torque, precise, _, found) = interleaved(
        cpu, 7, product, integrator, with_energies, lambda: peer_mujoco(model, data)
    )
    share = 1000
    finer = loaded(MJCF.replace("implicitfast", "RK4"))
    (rk4_s,), (better,) = interleaved(cpu, 2, lambda: peer_mujoco(*finer))
    (lsoda_s,), (smoothed,) = interleaved(cpu, 1, lambda: lsoda(share))
    lsoda_s *= TICKS / share
    error = rms(torque - exact)
    print(f"B1, CPU time for 10 s, torque error rms; the engine chosen is {ran().engine}:")
    print(f"  as it is chosen    {ours * 1e3:9.3f} ms  {error:.2g} Nm")
    print(f"  with its energies  {whole * 1e3:9.3f} ms")
    print(f"  event-driven       {slow * 1e3:9.3f} ms  {rms(precise - exact):.2g} Nm")
    print(f"  MuJoCo 1 ms        {peer * 1e3:9.3f} ms  {rms(found - exact):.2g} Nm")
    print(f"  MuJoCo 1 ms, RK4   {rk4_s * 1e3:9.3f} ms  {rms(better - exact):.2g} Nm")
    off = rms(smoothed - exact[: share + 1])
    print(f"  scipy LSODA        {lsoda_s * 1e3:9.0f} ms  {off:.2g} Nm (1 s, time x 10)")
    print(f"  torque error {error:.2g} Nm (target {LARGEST_ERROR_Nm:g})")
    return [
        error <= LARGEST_ERROR_Nm,
        judged("x MuJoCo", peer / ours, OVER_MUJOCO),
        judged("x LSODA", lsoda_s / ours, OVER_LSODA),
    ]


def bench_batch(model) -> list[bool]:
    """RUNS gains, wall time on THREADS threads."""
    batch(1)
    wall = time.perf_counter
    (ours, peer), (found, _) = interleaved(
        wall, 3, lambda: batch(THREADS), lambda: peer_batch(model)
    )
    (alone,), (one,) = interleaved(wall, 1, lambda: batch(1))
    same = bool(np.array_equal(found, one))
    scaled = peer * RUNS / PEER_RUNS
    print(f"{RUNS} closed-loop runs of 10 s, wall time on {THREADS} threads:")
    print(f"  run_batch          {ours:9.2f} s ({alone:.2f} s on 1 thread)")
    print(f"  same to the bit on 1 and {THREADS} threads: {'yes' if same else 'NO'}")
    print(f"  mujoco.rollout     {scaled:9.1f} s (open loop, {PEER_RUNS} runs, time scaled)")
    return [same, judged("x MuJoCo", scaled / ours, BATCH_OVER_MUJOCO)]


def main() -> int:
    """Run all, print the tables, say which targets are met."""
    if mujoco is None:
        print("MuJoCo is not installed (pip install mujoco): its targets cannot be shown")
        return 1
    model, data = loaded()
    met = bench_b1(model, data) + bench_full() + bench_batch(model)
    print("all targets met" if all(met) else "a target is missed")
    return 0 if all(met) else 1


if __name__ == "__main__":
    sys.exit(main())
