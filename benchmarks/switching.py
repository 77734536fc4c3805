"""How many random machines with worm, backlash, spring and contact stop the event-driven engine.

    python benchmarks/switching.py [--runs 400] [--first 0] [--engine piecewise-linear]

Every other run is an open-loop sine of the duty, the others are torque loops (PID). A machine has
a worm (friction that grows with the transmitted torque, self-locking or not), backlash, dry
friction of the gear in half of them, a spring with or without hysteresis, and a load that is
locked, free, a pendulum or one that meets a contact. Printed are the runs that did not end, with
their reason, and the largest error of the energy balance relative to the energy that passed.
"""

import argparse
import time

import numpy as np

from rsea_core import (
    ActuatorModel,
    Inputs,
    Load,
    PidTorque,
    Reference,
    Rig,
    simulate,
    simulate_closed_loop,
)
from rsea_core.effects import GearBacklash, GearEfficiency, GearFriction, SpringHysteresis
from rsea_core.errors import SimulationError
from rsea_core.simulation.trajectory import Trajectory

ROWS_s = (1e-3, 5e-4, 2e-4)
DURATION_s = 1.0


def machine(rng: np.random.Generator) -> tuple[ActuatorModel, Load]:
    """A random machine and what it is joined to."""
    terms = [
        GearEfficiency(
            drive_efficiency=rng.uniform(0.3, 0.95), backdrive_efficiency=rng.uniform(-0.8, 0.9)
        ),
        GearBacklash(
            width_rad=10.0 ** rng.uniform(-4.0, -1.5),
            wheel_inertia_kgm2=10.0 ** rng.uniform(-3.5, -2.0),
            wheel_damping_Nms_per_rad=0.0,
            rebound=rng.choice([0.0, 0.3, 0.7]),
        ),
    ]
    if rng.random() < 0.5:
        terms.append(GearFriction(coulomb_Nm=10.0 ** rng.uniform(-3.5, -2.0)))
    if rng.random() < 0.3:
        terms.append(SpringHysteresis(yield_1_rad=0.02, stiffness_1_Nm_per_rad=6.0))
    kind = rng.choice(["locked", "free", "pendulum", "contact"])
    contact = {}
    if kind == "contact":
        contact = {
            "contact_stiffness_Nm_per_rad": 10.0 ** rng.uniform(2.0, 3.5),
            "contact_angle_rad": rng.uniform(0.0, 0.3),
            "contact_damping_Nms_per_rad": rng.choice([0.0, 1.0]),
        }
    model = ActuatorModel(Rig.preset("rsea-bench"), terms=tuple(terms))
    return model, Load(kind=str(kind), **contact)


def run(seed: int, engine: str | None = "event-driven") -> Trajectory:
    """The run of this seed."""
    rng = np.random.default_rng(seed)
    model, load = machine(rng)
    row, hertz = rng.choice(ROWS_s), 10.0 ** rng.uniform(-0.3, 1.3)
    if seed % 2 == 0:
        t = np.arange(round(DURATION_s / row) + 1) * row
        duty = rng.uniform(0.02, 0.9) * np.sin(2.0 * np.pi * hertz * t)
        return simulate(model, Inputs(time_s=t, duty=duty, load=load), engine=engine)
    law = PidTorque(kp=rng.uniform(1.0, 30.0), ki=rng.uniform(0.0, 60.0), kd=rng.uniform(0.0, 0.5))
    sine = Reference(kind="sine", amplitude_Nm=rng.uniform(0.2, 5.0), frequency_Hz=hertz)
    return simulate_closed_loop(
        model, law, sine, load, duration_s=DURATION_s, row_s=row, refuse_unstable=False,
        engine=engine,
    )  # fmt: skip


def main() -> None:
    """Run all and print what stopped."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=400)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--engine", default="event-driven")
    asked, began, stopped, worst = parser.parse_args(), time.perf_counter(), [], 0.0
    for seed in range(asked.first, asked.first + asked.runs):
        try:
            energy = run(seed, asked.engine).energy
        except SimulationError as error:
            stopped.append(seed)
            print(f"{seed}: {error}", flush=True)
            continue
        entered = max(np.ptp(energy.supplied_J), np.ptp(energy.lost_J()))
        worst = max(worst, np.abs(energy.imbalance_J()).max() / entered)
    took = time.perf_counter() - began
    print(f"{asked.runs} runs in {took:.0f} s; stopped: {len(stopped)}; energy: {worst:.2g}")


if __name__ == "__main__":
    main()
