"""A controller written in C answers as the simulated one to 1e-9."""

import math
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from rsea_core import ActuatorModel, Load, Reference, Rig
from rsea_core.control import (
    DisturbanceObserverTorque,
    FractionalPidTorque,
    FuzzyTorque,
    HybridImpedance,
    LqgTorque,
    PidTorque,
    simulate_closed_loop,
)
from rsea_core.control.c_header import c_header
from rsea_core.effects import GearFriction, GearLoadFriction
from rsea_core.errors import ControllerError
from rsea_core.simulation.reference import AngleReference

MODEL = ActuatorModel(
    Rig.preset("rsea-bench"),
    (
        GearFriction(coulomb_Nm=0.01, stribeck_rise=0.5, stribeck_velocity_rad_per_s=1.0),
        GearLoadFriction(lead_angle_rad=math.radians(4.0), friction_coefficient=0.06),
    ),
)
MAIN = """
#include <stdio.h>
#include "controller.h"
int main(void) {
    rsea_state state;
    rsea_input y;
    rsea_start(&state);
    while (scanf("%lf %lf %lf %lf %lf", &y.reference, &y.reference_rate,
                 &y.reference_acceleration, &y.motor_angle_rad, &y.load_angle_rad) == 5)
        printf("%.17g\\n", rsea_step(&state, &y));
    return 0;
}
"""
TORQUE = Reference(kind="sine", amplitude_Nm=4.0, frequency_Hz=1.3)
ANGLE = AngleReference(kind="sine", amplitude_rad=0.2, frequency_Hz=0.8)


def replayed(header: str, rows: np.ndarray, folder: Path) -> np.ndarray:
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("no C compiler on this machine")
    (folder / "controller.h").write_text(header, encoding="utf-8")
    (folder / "main.c").write_text(MAIN, encoding="utf-8")
    strict = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-O1", "-ffp-contract=off"]
    subprocess.run([compiler, *strict, "main.c", "-o", "replay", "-lm"], cwd=folder, check=True)
    text = "\n".join(" ".join(f"{x:.17g}" for x in row) for row in rows)
    done = subprocess.run(
        ["./replay"], cwd=folder, input=text, capture_output=True, text=True, check=True
    )
    return np.array([float(line) for line in done.stdout.split()])


@pytest.mark.parametrize(
    ("controller", "load"),
    [
        (PidTorque(kd=0.2, friction_compensation=0.8, back_emf="measured"), Load(kind="locked")),
        (PidTorque(load_feedforward="acceleration"), Load()),
        (FuzzyTorque(friction_compensation=1.0), Load(kind="locked")),
        (DisturbanceObserverTorque(), Load(kind="locked")),
        (DisturbanceObserverTorque(delay_samples=0, friction_compensation=0.5), Load()),
        (LqgTorque(friction_compensation=1.0), Load(kind="locked")),
        (LqgTorque(delay_samples=0), Load()),
        (HybridImpedance(beta=0.8, gamma=0.7, alpha=0.4), Load()),
        (HybridImpedance.preset("seed-code"), Load()),
    ],
    ids=lambda c: c.kind,
)
def test_the_header_answers_as_the_simulated_controller_to_1e_9(controller, load, tmp_path):
    reference = ANGLE if controller.kind == "impedance" else TORQUE
    ran = simulate_closed_loop(
        MODEL, controller, reference, load, duration_s=1.5, refuse_unstable=False
    )
    every = max(round(controller.sample_time_s / 1e-3), 1)
    samples = slice(0, None, every)
    rows = np.column_stack(
        (
            reference.sample(ran.time_s)[samples],
            ran.encoder_motor_angle_rad[samples],
            ran.encoder_load_angle_rad[samples],
        )
    )
    commands = replayed(c_header(controller, MODEL, load), rows, tmp_path)
    expected = ran.command[samples]
    late = controller.delay_samples
    assert np.abs(expected).max() > 0.01
    np.testing.assert_allclose(
        commands[: commands.size - late], expected[late:], rtol=0.0, atol=1e-9
    )


def test_what_has_no_c_form_is_refused():
    with pytest.raises(ControllerError, match="fo-pid has no C form"):
        c_header(FractionalPidTorque(), MODEL, Load())
    with pytest.raises(ControllerError, match="ideal_sensors"):
        c_header(PidTorque(ideal_sensors=True), MODEL, Load())
