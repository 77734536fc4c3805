"""Candidates for any machine hold no absolute number: all follow the machine's torque and time."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.effects.drive_dead_zone import DriveDeadZone, RoundedDeadZone, ThresholdDeadZone
from rsea_core.effects.drive_saturation import DriveSaturation
from rsea_core.effects.layout import N_EFFECTS
from rsea_core.effects.variant import PLANT, RunConditions, TrialMachine
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.candidates.typical_magnitudes import own_magnitudes
from rsea_core.machine.inputs import Load
from rsea_core.machine.rig import Rig
from rsea_core.model.diagnosed_effects import read_laws
from rsea_core.recordings.recording import Recording
from tests.cases.one_axis import Units, axis_case, axis_recording, axis_rig

SMALL_AND_FAST = Units(torque=1e-6, time=1e-3)
POWERS = {  # of torque and of time in each unit
    "Nm": (1, 0), "Nm/rad": (1, 0), "Nm/rad^3": (1, 0), "Nms/rad": (1, 1), "kgm2": (1, 2),
    "rad": (0, 0), "rad/s": (0, -1), "1/s": (0, -1), "Hz": (0, -1), "s": (0, 1),
    "-": (0, 0), "A": (0, 0),
}  # fmt: skip
NAMED = {"torque_at_5_rad_per_s_Nm": (1, 2)}  # stands for a torque over a speed squared
ABSOLUTE = {"drive-delay", "drive-thermal"}  # a nuisance; temperatures are no matter of torque


@pytest.fixture(scope="module")
def cases(tmp_path_factory):
    folder = tmp_path_factory.mktemp("axis")
    return [
        axis_case(folder, axis_recording(seed=3, units=units), rig=axis_rig(units))
        for units in (Units(), SMALL_AND_FAST)
    ]


def test_typical_speed_time_and_torque_scale_with_the_machine(cases):
    large, small = (own_magnitudes(case) for case in cases)
    assert small.time_s == pytest.approx(1e-3 * large.time_s, rel=1e-3, abs=0.0)
    assert small.speed_rad_per_s == pytest.approx(1e3 * large.speed_rad_per_s, rel=1e-3, abs=0.0)
    assert small.load_torque_Nm == pytest.approx(1e-6 * large.load_torque_Nm, rel=1e-3, abs=0.0)
    assert small.motor_torque_Nm == pytest.approx(1e-6 * large.motor_torque_Nm, rel=1e-3, abs=0.0)


def test_typical_speed_does_not_come_from_the_steps_of_a_coarse_encoder(tmp_path):
    r = axis_recording(seed=3)
    fine = own_magnitudes(axis_case(tmp_path, r, rig=axis_rig()))
    assert fine.speed_rad_per_s == pytest.approx(fine.angle_rad / fine.time_s)
    assert 0.2 < fine.time_s < 0.6  # of three sines of 0.31, 0.83 and 1.9 Hz


def test_a_spring_with_a_locked_end_deflects_as_the_motor_turns(tmp_path):
    """At resonance by many times torque over stiffness."""
    rig = Rig(name="oscillator", parts=("drive", "gear", "spring"), torque_constant_Nm_per_A=1.0,
              motor_inertia_kgm2=1e-5, gear_ratio=4.0, spring_stiffness_Nm_per_rad=1.0)  # fmt: skip
    time = 1e-2 * np.arange(500)
    columns = {"time_s": time, "current_command_A": 1e-4 * np.sin(time),
               "motor_angle_rad": 0.4 * np.sin(time)}  # fmt: skip
    r = Recording(file="sine.csv", load=Load(kind="locked"), columns=columns, sample_time_s=1e-2)
    found = own_magnitudes(axis_case(tmp_path, r, rig=rig))
    assert found.deflection_rad == pytest.approx(np.std(0.1 * np.sin(time)))


def test_the_peak_current_of_a_voltage_is_what_back_emf_leaves_of_it(tmp_path):
    rig = Rig(name="motor", parts=("drive", "load"), terminal_resistance_ohm=2.0,
              torque_constant_Nm_per_A=0.5, back_emf_constant_Vs_per_rad=0.5, current_limit_A=50.0,
              load_inertia_kgm2=0.02)  # fmt: skip
    time = 1e-2 * np.arange(500)
    columns = {"time_s": time, "voltage_V": np.full(500, 3.0), "motor_angle_rad": 2.0 * time}
    r = Recording(file="steady.csv", load=Load(kind="free"), columns=columns, sample_time_s=1e-2)
    typical = own_magnitudes(axis_case(tmp_path, r, rig=rig))
    assert typical.peak_current_A == pytest.approx((3.0 - 0.5 * 2.0) / 2.0)
    assert typical.often_read_A is None
    limit = next(w for w in DriveSaturation.candidates(typical) if w.law == "limit")
    assert max(limit.starts)[0] == pytest.approx(1.0)
    assert limit.unknowns[0].high == 50.0  # the limit of the rig file


def test_limits_and_starts_of_laws_scale_with_the_machine(cases):
    large, small = (catalogue(case, relative=True) for case in cases)
    assert large.keys() == small.keys()
    for key, law in large.items():
        if law.effect in ABSOLUTE or law.sensor is not None:
            continue
        other = small[key]
        for j, (a, b) in enumerate(zip(law.unknowns, other.unknowns, strict=True)):
            torque, time = NAMED.get(a.name) or POWERS[a.unit]
            factor = SMALL_AND_FAST.torque**torque * SMALL_AND_FAST.time**time
            assert b.low == pytest.approx(factor * a.low, rel=1e-2, abs=0.0), (key, a.name, "low")
            assert b.high == pytest.approx(factor * a.high, rel=1e-2, abs=0.0), (
                key,
                a.name,
                "high",
            )
            if not a.log:
                assert b.scale == pytest.approx(factor * a.scale, rel=1e-2, abs=0.0), (key, a.name)
            for s, t in zip(law.starts, other.starts, strict=True):
                assert t[j] == pytest.approx(factor * s[j], rel=1e-2, abs=0.0), (
                    key,
                    a.name,
                    "start",
                )


def test_a_law_read_from_a_file_acts_as_on_the_case_that_it_was_found_on(cases):
    """A file holds values alone: no magnitude of the case may be hidden in the law."""
    for key, law in catalogue(cases[1], relative=True).items():
        values = law.values(np.array(law.starts[0]))
        entry = {"effect": law.effect, "law": law.law, "values": values}
        if law.sensor is not None:
            entry["column"] = law.sensor
        ((again, read),) = read_laws([entry], "model.toml")
        assert written(again, read) == written(law, values), key


def written(law, values):
    """Numbers that a law writes into a machine."""
    machine = TrialMachine(plant=np.ones(len(PLANT)), fx=np.zeros(N_EFFECTS), stiffness=1.0)
    law.write(values, machine, RunConditions(
        index=0, file="", kind="contact", ratio=2.0, session_s=0.0, case_rise_K=0.0,
        time_s=np.zeros(2),
    ))  # fmt: skip
    return machine.fx.tolist(), machine.plant.tolist()


def test_no_current_limit_is_tried_below_the_currents_that_are_often_read(cases):
    typical = replace(own_magnitudes(cases[0]), peak_current_A=3.0)

    def least_limit_A(read):
        laws = DriveSaturation.candidates(replace(typical, often_read_A=read))
        return next(w for w in laws if w.law == "limit").unknowns[0].low

    assert typical.often_read_A is None  # an axis that reads its angle alone
    assert least_limit_A(None) == pytest.approx(0.3)
    assert least_limit_A(2.0) == pytest.approx(1.8)
    assert least_limit_A(100.0) < typical.rig.current_limit_A


@pytest.mark.parametrize("law", [DriveDeadZone, RoundedDeadZone, ThresholdDeadZone])
def test_a_drive_that_is_commanded_a_torque_may_have_a_dead_zone(cases, law):
    typical = replace(own_magnitudes(cases[0]), commands=frozenset({"motor_torque_Nm"}))
    (found,) = law.candidates(replace(typical, command=2.0))
    assert found.unknowns[0].high == 2.0
    assert found.starts[0][0] == pytest.approx(0.014)
    assert not law.candidates(replace(typical, commands=frozenset({"position_command_rad"})))
