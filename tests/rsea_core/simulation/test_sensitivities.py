"""Derivatives of a run through stick, slip, contact and limits are those of central differences."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from rsea_core import ActuatorModel, Load, Rig
from rsea_core.control.laws.pid import PidTorque
from rsea_core.effects import GearBacklash, GearFriction, LoadFriction
from rsea_core.errors import InputError, SimulationError
from rsea_core.simulation.sensitivities import sensitivities, value_of, with_value

RIG = replace(
    Rig.preset("rsea-bench"), motor_encoder_counts_per_rev=None, load_encoder_counts_per_rev=None,
    load_mass_kg=0.0, load_inertia_kgm2=0.05, current_limit_A=0.6,
)  # fmt: skip
DRY = ActuatorModel(RIG, (GearFriction(coulomb_Nm=0.03), LoadFriction(coulomb_Nm=0.2)))
TIME = np.arange(401) * 1e-3
WAVE = np.column_stack(
    (0.5 * np.sin(2 * np.pi * 9 * TIME) + 0.3 * np.sin(2 * np.pi * 23 * TIME), 0 * TIME, 0 * TIME)
)
WALL = Load(kind="contact", contact_stiffness_Nm_per_rad=150.0, contact_angle_rad=0.002,
            contact_damping_Nms_per_rad=0.5)  # fmt: skip
BOUND = 1e-7  # of the largest derivative


def central(run, value):
    """Derivative of an array by Richardson's extrapolation of central differences."""
    h = 2e-4 * abs(value)
    first, second = (
        (run(value + x) - run(value - x)) / (2.0 * x) for x in (h, 0.5 * h)
    )  # fmt: skip
    return (4.0 * second - first) / 3.0


@pytest.mark.parametrize(
    ("load", "names", "kinds"),
    [
        (
            Load(kind="free"),
            ("load_inertia_kgm2",),
            {"wheel stops", "load stops", "current limit", "current falls"},
        ),
        (WALL, ("gear-friction.coulomb_Nm",), {"wheel stops", "contact"}),
    ],
)
def test_open_loop_derivatives_hold_through_twenty_events(load, names, kinds):
    asked = {"time_s": TIME, "reference": WAVE}
    found = sensitivities(DRY, "duty", load, parameters=names, **asked)
    events = Counter(name for _, name in found.events)
    assert sum(events.values()) >= 20
    assert kinds <= set(events)
    for j, name in enumerate(names):
        expected = central(
            lambda v, name=name: (
                sensitivities(with_value(DRY, name, v), "duty", load, **asked).torque_Nm
            ),
            value_of(DRY, name),
        )
        error = np.abs(found.torque_by[:, j] - expected).max()
        assert error < BOUND * np.abs(expected).max(), (name, events)


def test_closed_loop_derivatives_by_gains_and_start_are_those_of_central_differences():
    load, model = Load(kind="locked"), ActuatorModel(RIG, (GearFriction(coulomb_Nm=0.01),))
    time = TIME[:201]
    phase = 2 * np.pi * 12 * time
    reference = np.column_stack(
        (np.sin(phase), 24 * np.pi * np.cos(phase), -((24 * np.pi) ** 2) * np.sin(phase))
    )

    def law(gains):
        return PidTorque(**gains).compile(model, load)

    def run(**changed):
        gains = {"kp": 30.0, "ki": 20.0}
        starts = {"initial_motor_angle_rad": 0.3}
        for name, value in changed.items():
            (gains if name in gains else starts)[name] = value
        return sensitivities(
            model, "duty", load, time_s=time, reference=reference, controller=law, gains=gains,
            starts=starts, delay_samples=1,
        )  # fmt: skip

    found = run()
    assert len(found.events) >= 4
    for j, name in enumerate(found.names):
        value = {"kp": 30.0, "ki": 20.0, "initial_motor_angle_rad": 0.3}[name]
        expected = central(lambda v, name=name: run(**{name: v}).torque_Nm, value)
        error = np.abs(found.torque_by[:, j] - expected).max()
        assert error < BOUND * np.abs(expected).max(), name


@pytest.mark.parametrize(
    ("model", "load", "more", "error", "says"),
    [
        (ActuatorModel(RIG, (GearBacklash(width_rad=1e-3, wheel_inertia_kgm2=1e-3),)),
         Load(kind="free"), {}, SimulationError, "the machine has internal_states, backlash"),
        (ActuatorModel(Rig.preset("rsea-bench")), Load(), {}, SimulationError, "gravity"),
        (DRY, Load(kind="free"), {"parameters": ("stiffness",)}, InputError, "no parameter"),
        (DRY, Load(kind="free"), {"starts": {"speed": 1.0}}, InputError, "must be one of"),
    ],
)  # fmt: skip
def test_what_cannot_be_differentiated_is_refused_by_name(model, load, more, error, says):
    with pytest.raises(error, match=says):
        sensitivities(model, "duty", load, time_s=TIME, reference=WAVE, **more)
