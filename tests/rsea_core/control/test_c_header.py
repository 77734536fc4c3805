"""A controller written in C answers as the simulated one to 1e-12, and survives bad samples."""

import math
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import rsea_core
from rsea_core import ActuatorModel, Load, Reference, Rig
from rsea_core.control import (
    AdaptiveImpedance,
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
STRICT = ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Werror", "-O1",
          "-ffp-contract=off"]  # fmt: skip
CONTACT = Load(
    kind="contact",
    contact_stiffness_Nm_per_rad=30.0,
    contact_angle_rad=0.05,
    contact_damping_Nms_per_rad=0.5,
)
LEAST = 0.25


@rsea_core.controller(sample_time_s=1e-3)
class Everything:
    """A law that uses all that has a C form."""

    kp: float = 0.02
    ki: float = 0.4
    state = {"integral": 0.01, "last": 0.0}  # noqa: RUF012

    def design(self, machine):
        return {"T": machine.sample_time_s}

    def step(self, y):
        error = y.reference - y.torque_Nm
        low, high = -LEAST, LEAST
        low, high = high, low
        if abs(error) > 2.0 and not (error < 0.0 or y.deflection_rad > 1.0):
            self.integral *= 0.99
        elif low > 0.0 <= high + 1:
            self.integral = 0.0
        else:
            self.integral += self.ki * self.T * max(min(error, low), high)
        wave = (y.motor_angle_rad * 10) % 2.0 - y.motor_angle_rad // 3
        both = 1.0 if (wave > 0.5) == True else math.pi / 4  # noqa: E712
        self.last = max(min(wave, 1.0, both), -1.0) ** 2 + float(self.last > 0.1) * 1e-5
        return self.kp * error + self.integral + 1e-3 * math.atan2(self.last, 2.0) * np.sign(error)


@rsea_core.controller(sample_time_s=2e-3)
def by_deflection(y, gain=0.3):
    """A law without state."""
    return gain * (0.05 * np.tanh(y.reference) - y.deflection_rad)


TORQUE = Reference(kind="sine", amplitude_Nm=4.0, frequency_Hz=1.3)
ANGLE = AngleReference(kind="sine", amplitude_rad=0.2, frequency_Hz=0.8)


def replayed(header: str, rows: np.ndarray, folder: Path, main: str = MAIN) -> np.ndarray:
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("no C compiler on this machine")
    (folder / "controller.h").write_text(header, encoding="utf-8")
    (folder / "main.c").write_text(main, encoding="utf-8")
    subprocess.run([compiler, *STRICT, "main.c", "-o", "replay", "-lm"], cwd=folder, check=True)
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
        (AdaptiveImpedance(selection=0.7, force_N=2.0), CONTACT),
        (AdaptiveImpedance(filter_s=0.0, angle_unit="rad"), Load()),
        (FractionalPidTorque(friction_compensation=1.0), Load(kind="locked")),
        (FractionalPidTorque(derivative_order=0.8, back_emf="measured"), Load()),
        (Everything(), Load(kind="locked")),
        (by_deflection(), Load()),
    ],
    ids=lambda c: c.kind,
)
def test_the_header_answers_as_the_simulated_controller_to_1e_12(controller, load, tmp_path):
    reference = ANGLE if controller.reference_name.endswith("_rad") else TORQUE
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
        commands[: commands.size - late], expected[late:], rtol=0.0, atol=1e-12
    )


SINGLE = (
    MAIN.replace("rsea_input y;", "rsea_input y; double r[5];")
    .replace("&y.reference, &y.reference_rate,", "r, r + 1, r + 2, r + 3, r + 4) == 5) {")
    .replace(
        "&y.reference_acceleration, &y.motor_angle_rad, &y.load_angle_rad) == 5)",
        "y.reference = (float)r[0]; y.reference_rate = (float)r[1];"
        " y.reference_acceleration = (float)r[2]; y.motor_angle_rad = (float)r[3];"
        " y.load_angle_rad = (float)r[4];",
    )
    .replace("rsea_step(&state, &y));", "(double)rsea_step(&state, &y)); }")
)


@pytest.mark.parametrize(
    "controller",
    [
        PidTorque(kd=0.2),
        FuzzyTorque(),
        DisturbanceObserverTorque(),
        LqgTorque(),
        HybridImpedance(),
        AdaptiveImpedance(),
        FractionalPidTorque(),
        Everything(),
    ],
    ids=lambda c: c.kind,
)
def test_every_law_compiles_in_single_precision_without_a_warning(controller, tmp_path):
    header = c_header(controller, MODEL, Load(kind="locked"), real="float")
    assert "double" not in header
    rows = np.zeros((200, 5))
    rows[:, 0] = 0.1
    single = replayed(header, rows, tmp_path, SINGLE)
    double = replayed(c_header(controller, MODEL, Load(kind="locked")), rows, tmp_path)
    assert np.abs(double).max() > 0.0
    np.testing.assert_allclose(single, double, rtol=0.0, atol=1e-4)


def test_a_sample_that_is_no_number_is_held_and_forgotten(tmp_path):
    header = c_header(PidTorque(), MODEL, Load(kind="locked"))
    rows = np.zeros((60, 5))
    rows[:, 0] = 2.0
    clean = replayed(header, rows, tmp_path)
    spoiled = rows.copy()
    spoiled[20, 3], spoiled[21, 4], spoiled[22, 0] = np.nan, np.inf, np.nan
    answer = replayed(header, spoiled, tmp_path)
    assert np.isfinite(answer).all()
    np.testing.assert_array_equal(answer[20:23], clean[19])
    np.testing.assert_array_equal(answer[23:], clean[20:57])
    spoiled[20:40, 3] = np.nan
    lost = replayed(header, spoiled, tmp_path)
    assert lost[39] == 0.0
    np.testing.assert_array_equal(lost[40:], clean[:20])


def test_two_controllers_with_names_of_their_own_share_one_file(tmp_path):
    parts = [
        c_header(law, MODEL, Load(kind="locked"), prefix=prefix)
        for law, prefix in ((PidTorque(), "inner"), (FuzzyTorque(), "outer"))
    ]
    rows = np.zeros((50, 5))
    rows[:, 0] = 1.0
    defines = "#define T 7\n#define KP 8\n"
    alone = replayed(c_header(FuzzyTorque(), MODEL, Load(kind="locked")), rows, tmp_path)
    both = replayed(defines + "\n".join(parts), rows, tmp_path, MAIN.replace("rsea_", "outer_"))
    np.testing.assert_array_equal(both, alone)


@rsea_core.controller(sample_time_s=1e-3)
def counting(y):
    total = 0.0
    for part in (1.0, 2.0):
        total += part
    return total


@rsea_core.controller(sample_time_s=1e-3)
def by_current(y):
    return 0.1 * y.current_A


@rsea_core.controller(sample_time_s=1e-3)
def in_bands(y):
    if -0.5 < y.reference < 0.5 or 2.0 < y.reference <= 3.0:
        return y.reference // 0.1 * 1e-3
    return -0.01 * (y.reference // -0.1)


@rsea_core.controller(sample_time_s=1e-3)
def without_end(y):
    if y.reference > 0.0:
        return 1.0


def test_chained_comparisons_and_whole_quotients_are_those_of_python(tmp_path):
    """1.0 // 0.1 is 9, where floor(1.0 / 0.1) is 10; gcc warns of && inside || without brackets."""
    rows = np.zeros((9, 5))
    rows[:, 0] = [1.0, -1.0, 0.3, -0.3, 2.0, 2.4, 3.0, -3.7, 0.6]
    commands = replayed(c_header(in_bands(), MODEL, Load(kind="locked")), rows, tmp_path)
    wanted = [r // 0.1 * 1e-3 if -0.5 < r < 0.5 or 2.0 < r <= 3.0 else -0.01 * (r // -0.1)
              for r in rows[:, 0]]  # fmt: skip
    np.testing.assert_array_equal(commands, wanted)


@pytest.mark.parametrize(
    ("law", "says"),
    [
        (counting, r"counting has no C form: line \d+: 'for part in"),
        (by_current, r"line \d+: y.current_A is no input"),
        (without_end, "not every way through it returns a command"),
    ],
)
def test_an_own_law_without_c_form_is_refused_with_its_line(law, says):
    with pytest.raises(ControllerError, match=says):
        c_header(law(), MODEL, Load(kind="locked"))


def test_what_cannot_be_used_is_refused():
    with pytest.raises(ControllerError, match="prefix 'A B'"):
        c_header(PidTorque(), MODEL, Load(kind="locked"), prefix="A B")
    with pytest.raises(ControllerError, match="ideal_sensors"):
        c_header(PidTorque(ideal_sensors=True), MODEL, Load())
