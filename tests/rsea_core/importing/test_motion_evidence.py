"""Friction that the rig file states is part of what a motion needs; unknown friction is no unit."""

import re
from dataclasses import replace

import numpy as np

from rsea_core.importing.motion_evidence import motion_laws
from rsea_core.importing.proposal import propose
from rsea_core.machine.rig import Rig
from rsea_core.terms.known import known_terms

RIG = Rig(
    name="pump", parts=("drive", "gear", "load"), axis="linear", gear_ratio=500.0,
    torque_constant_Nm_per_A=0.01, motor_inertia_kgm2=1e-6, load_inertia_kgm2=0.5,
    motor_encoder_counts_per_rev=2000.0,
)  # fmt: skip
DRY_N, VISCOUS = 20.0, 300.0
TERM = {"effect": "load-friction", "coulomb_Nm": DRY_N}
STATED = replace(RIG, load_viscous_Nms_per_rad=VISCOUS)


def slow_stroke(scale: float = 1.0):
    """A slow motion of a carriage that little but friction resists, and its current in A."""
    t = 1e-3 * np.arange(6000)
    x = 0.02 * np.sin(1.5 * t)
    speed = np.gradient(x, t)
    force = 0.75 * np.gradient(speed, t) + VISCOUS * speed + DRY_N * np.sign(speed)
    current = np.round(force / (500.0 * 0.01), 4)
    return {"time_s": t, "load_angle_rad": x, "current_command_A": scale * current}


def ratio(rig: Rig, terms=()) -> float:
    (law,) = motion_laws(rig, slow_stroke(), 500.0, terms)
    return law.ratio


def test_stated_dry_and_viscous_friction_are_needed_of_the_command():
    known = known_terms({"term": [TERM]}, RIG, "rig.toml")
    assert abs(ratio(STATED, known) - 1.0) < 0.1
    assert ratio(STATED) > 1.5
    laws = motion_laws(RIG, slow_stroke(), 500.0)
    assert not laws or laws[0].is_excess


def test_friction_of_the_motor_counts_behind_the_gear():
    term = {"effect": "gear-friction", "coulomb_Nm": DRY_N / 500.0}
    assert abs(ratio(STATED, known_terms({"term": [term]}, RIG, "rig.toml")) - 1.0) < 0.1


def test_more_torque_than_a_motion_needs_does_not_question_a_stated_unit():
    columns = slow_stroke(25.0)
    raw = {
        "t [s]": columns["time_s"], "Weg [mm]": 1e3 * columns["load_angle_rad"],
        "i_ref [A]": columns["current_command_A"],
    }  # fmt: skip
    found = propose(raw, {}, STATED)
    assert not found.questions
    assert re.search("gives [0-9.]+ times", found.column("current_command_A").reason)
    silent = {n.split()[0] if n.startswith("Weg") else n: v for n, v in raw.items()}
    assert any("'Weg'" in q for q in propose(silent, {}, STATED).questions)
