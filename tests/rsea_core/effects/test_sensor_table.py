"""The table of a reading: one law in a diagnosis, a simulation, a controller's loop and a batch."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core import (
    ActuatorModel,
    Inputs,
    Load,
    PidTorque,
    Reference,
    Rig,
    read_model,
    readings,
    run_batch,
    simulate,
    simulate_closed_loop,
    write_model,
)
from rsea_core.effects import SensorDelay, SensorNoise, SensorOffset, SensorScale, SensorTable
from rsea_core.effects.residual_table import SPEED, TURN, VALUE, nodes_of, reading_law
from rsea_core.errors import TermError
from rsea_core.identify.result.corrected_model import FoundModel
from rsea_core.interop.mjcf import to_mjcf
from rsea_core.model.diagnosed_effects import map_laws
from rsea_core.recordings.case import InputRecording
from rsea_core.simulation.simulate_fast import simulate_stepping

COUNTED = Rig.preset("rsea-bench")
RIG = replace(COUNTED, motor_encoder_counts_per_rev=None, load_encoder_counts_per_rev=None)
TIME_s = 0.002 * np.arange(400)
INPUTS = Inputs(
    time_s=TIME_s, load=Load(kind="pendulum"),
    duty=0.35 * np.sin(4.0 * np.pi * TIME_s) + 0.1 * np.sin(18.0 * np.pi * TIME_s),
)  # fmt: skip
LOCKED = Load(kind="locked")
# column, what it is tabled over, span of the nodes (inside what the run reaches), largest entry
TABLES = [
    ("torque_Nm", VALUE, (-1.0, 1.5), 0.3),
    ("current_A", VALUE, (-0.4, 0.5), 0.1),
    ("load_angle_rad", VALUE, (-0.1, 0.15), 0.02),
    ("motor_angle_rad", VALUE, (-5.0, 4.0), 0.4),
    ("motor_angle_rad", TURN, (0.0, 2.0 * np.pi), 0.3),
    ("motor_angle_rad", SPEED, (0.0, 90.0), 0.4),
    ("load_angle_rad", SPEED, (0.0, 1.0), 0.1),
]


def tabled(column, over, span, peak):
    law = reading_law(column, over, 9, span, peak)
    entries = peak * np.cos(1.7 * np.arange(9.0))
    return law, {"first": span[0], "last": span[1]} | {
        f"at_{j}": float(v) for j, v in enumerate(entries, 1)
    }


@pytest.mark.parametrize("table", TABLES, ids=lambda t: f"{t[0]} {t[1]}")
def test_a_simulation_reads_what_the_diagnosis_predicts_to_round_off(tmp_path, table):
    found = FoundModel(rig=RIG, contact={}, laws=(tabled(*table),))
    path = tmp_path / "model.toml"
    path.write_text(found.to_toml(), encoding="utf-8")
    assert FoundModel.from_toml(path).to_toml() == found.to_toml()
    assert "left out" not in found.to_toml()
    model = read_model(path)
    run = simulate_stepping(model, INPUTS)
    plain = simulate_stepping(ActuatorModel(RIG), INPUTS)
    column = table[0]
    np.testing.assert_array_equal(getattr(run, column), getattr(plain, column))  # the truth stays
    read = readings(run)[column]
    span = np.ptp(read)
    assert np.abs(read - readings(plain)[column]).max() > 1e-3 * span
    if column == "current_A":  # no prediction has it
        return
    test = InputRecording(file="test.csv", inputs=INPUTS)
    assert read == pytest.approx(found.predict(test)[column], abs=1e-12 * span)
    # written as a term it is the same once more
    again = FoundModel.from_toml(write_model(model, tmp_path / "terms.toml"))
    assert again.laws == ()
    assert again.predict(test)[column] == pytest.approx(read, abs=1e-12 * span)


@pytest.mark.parametrize("table", TABLES, ids=lambda t: f"{t[0]} {t[1]}")
def test_a_law_becomes_a_term_and_keeps_its_nodes(table):
    law, values = tabled(*table)
    (term,) = map_laws(RIG, ((law, values),), ambient_C=25.0, contact={}).terms
    places, entries = nodes_of(values)
    assert (term.column, term.subsystem) == (law.sensor, law.subsystem)
    assert (f"over its {term.over}", term.first, term.last) == (law.law, places[0], places[-1])
    np.testing.assert_array_equal(term.errors, entries)
    assert term.column in term.equation()


@pytest.mark.parametrize(
    ("terms", "column"),
    [
        *(((map_laws(RIG, (tabled(*t),), ambient_C=25.0, contact={}).terms[0],), t[0])
          for t in TABLES if t[0] != "torque_Nm"),
        ((SensorScale(column="load_angle_rad", scale=1.1),
          SensorTable(column="load_angle_rad", over="turn", errors=[0.01, -0.01, 0.005]),
          SensorDelay(column="load_angle_rad", delay_s=0.0034)), "load_angle_rad"),
    ],
)  # fmt: skip
def test_a_controller_is_given_the_reading_and_a_batch_gives_it_the_same(terms, column):
    """The encoders of the loop are the readings; tuning's engine closes the same loop."""
    model = ActuatorModel(COUNTED, terms)
    law = PidTorque(kp=5.0, ki=0.0)
    sine = Reference(kind="sine", amplitude_Nm=1.0, frequency_Hz=3.0)
    run = simulate_closed_loop(model, law, sine, Load(kind="pendulum"), duration_s=0.4)
    plain = simulate_closed_loop(
        ActuatorModel(COUNTED), law, sine, Load(kind="pendulum"), duration_s=0.4
    )
    read = readings(run)
    for name in ("motor_angle_rad", "load_angle_rad"):
        count = 2.0 * np.pi / getattr(COUNTED, f"{name[:-10]}_encoder_counts_per_rev")
        # of values on the edge of a count round-off decides
        apart = np.abs(getattr(run, f"encoder_{name}") - read[name])
        assert np.mean(apart > 0.5 * count) < 0.02
        assert apart.max() < 1.01 * count
    compiled = law.compile(ActuatorModel(COUNTED), Load(kind="pendulum"))
    time = np.array(run.time_s)
    found = run_batch(
        [model, ActuatorModel(COUNTED)], compiled.function,
        np.array([compiled.parameters, compiled.parameters]), compiled.state, time_s=time,
        reference=sine.sample(time), command_name="duty", load=Load(kind="pendulum"),
        delay_samples=law.delay_samples, command_limit=compiled.command_limit, with_rows=True,
        step_s=2.5e-4,
    ).rows  # fmt: skip
    for rows, exact in zip(found, (run, plain), strict=True):
        assert np.abs(rows[:, 2] - exact.torque_Nm).max() < 0.02 * np.ptp(exact.torque_Nm)
    if column != "current_A":  # which this controller does not read
        assert np.abs(found[0, :, 2] - found[1, :, 2]).max() > 0.05 * np.ptp(plain.torque_Nm)


def test_a_table_of_one_height_is_an_offset_and_noise_is_the_terms_own_in_a_batch():
    law, time = PidTorque(kp=5.0, ki=20.0), 1e-3 * np.arange(300)
    sine = Reference(kind="sine", amplitude_Nm=1.0, frequency_Hz=3.0)
    flat = SensorTable(column="load_angle_rad", over="turn", errors=np.full(5, 0.013))
    noisy = SensorNoise(column="motor_angle_rad", standard_deviation=3.0, seed=3.0)
    machines = [
        ActuatorModel(COUNTED, terms)
        for terms in ((flat,), (SensorOffset(column="load_angle_rad", offset=0.013),),
                      (noisy,), (replace(noisy, seed=4.0),))
    ]  # fmt: skip
    compiled = law.compile(ActuatorModel(COUNTED), LOCKED)
    rows = run_batch(
        machines, compiled.function, np.array([compiled.parameters] * 4), compiled.state,
        time_s=time, reference=sine.sample(time), command_name="duty", load=LOCKED, with_rows=True,
        delay_samples=law.delay_samples, command_limit=compiled.command_limit, step_s=2.5e-4,
    ).rows  # fmt: skip
    np.testing.assert_array_equal(rows[0], rows[1])
    alone = simulate_closed_loop(machines[2], law, sine, LOCKED, duration_s=0.299)
    assert np.abs(rows[2, :, 2] - alone.torque_Nm).max() < 0.01 * np.ptp(alone.torque_Nm)
    assert np.abs(rows[2, :, 2] - rows[3, :, 2]).max() > 0.05 * np.ptp(alone.torque_Nm)


def test_a_written_simulation_holds_the_truth_and_what_sensors_show_of_it():
    """Encoders count what their terms leave in both engines; others read into columns of theirs."""
    terms = (
        SensorScale(column="torque_Nm", scale=1.25),
        SensorOffset(column="load_angle_rad", offset=0.1),
    )
    model = ActuatorModel(RIG, terms)
    for run in (simulate(model, INPUTS), simulate_stepping(model, INPUTS)):
        columns = run.columns()
        np.testing.assert_array_equal(columns["read_torque_Nm"], 1.25 * columns["torque_Nm"])
        apart = columns["encoder_load_angle_rad"] - columns["load_angle_rad"]
        assert apart == pytest.approx(0.1, abs=1e-12)
        assert [name for name in columns if name.startswith("read_")] == ["read_torque_Nm"]
    assert not any("read_" in name for name in simulate(ActuatorModel(RIG), INPUTS).columns())


def test_what_others_cannot_have_of_sensors_is_reported():
    model = ActuatorModel(COUNTED, (SensorOffset(column="load_angle_rad", offset=0.1),))
    assert any("sensor-offset:load_angle_rad" in note for note in to_mjcf(model, LOCKED).left_out)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"over": "place"}, "over = 'place' is not one of"),
        ({"over": "turn"}, "torque_Nm is no angle to have a turn"),
        ({"errors": [0.1]}, "errors must be 2 to"),
        ({"errors": ["a", "b"]}, "errors must be numbers"),
        ({"errors": [0.0, np.nan]}, "errors must be within"),
        ({"first": 1.0, "last": 1.0}, "last = 1.0 must be above first"),
    ],
)
def test_a_table_that_is_none_is_refused(given, message):
    with pytest.raises(TermError, match=message):
        SensorTable(**({"column": "torque_Nm", "over": "value", "errors": [0.1, 0.2]} | given))
