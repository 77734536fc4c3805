"""A diagnosed law and the effect made of it are one machine in predictions and simulations."""

from pathlib import Path

import numpy as np
import pytest

from rsea_core.effects.known_variants import laws_by_key
from rsea_core.effects.layout import N_EFFECTS
from rsea_core.effects.load_disturbance import disturbance
from rsea_core.effects.load_unbalance import unbalance
from rsea_core.effects.motor_cogging import cogging
from rsea_core.effects.registry import Port
from rsea_core.effects.sensor_reading import readings
from rsea_core.effects.slots import names, place_of
from rsea_core.effects.variant import RunConditions, TrialMachine
from rsea_core.engines.fixed_step.replay import CHANNELS, Replay
from rsea_core.errors import RigError
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.candidates.typical_magnitudes import typical_magnitudes_of
from rsea_core.identify.fitting.problem import predict_readings
from rsea_core.identify.result.corrected_model import FoundModel
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.model.diagnosed_effects import map_laws
from rsea_core.model.model_file import model_to_toml, read_model, read_model_file
from rsea_core.recordings.case import Case
from rsea_core.recordings.recording import Recording
from rsea_core.simulation.simulate import simulate

RIG = Rig.preset("rsea-bench")
TIME_s = 0.002 * np.arange(400)
DUTY = 0.35 * np.sin(2.0 * np.pi * 2.0 * TIME_s) + 0.1 * np.sin(2.0 * np.pi * 9.0 * TIME_s)
STEP_s = 2.5e-4
CONTACT = {
    "contact_stiffness_Nm_per_rad": 300.0,
    "contact_damping_Nms_per_rad": 1.0,
    "contact_angle_rad": 0.01,
}
LOADS = {"pendulum": Load(kind="pendulum"), "contact": Load(kind="contact", **CONTACT)}
ROUND_OFF = 1e-9  # of a signal's span: the same engine on numbers that differ in their last digit
# of a span: the fixed-step engine at its own step, which writes dry friction's stops and the mesh's
# impacts into whole steps, against events located exactly
STEPPING = 0.02


def replay_of(load: Load) -> Replay:
    return Replay.of(Inputs(time_s=TIME_s, duty=DUTY, load=load), step_s=STEP_s)


def nominal_case() -> Case:
    recordings = []
    for kind, load in LOADS.items():
        rows = replay_of(load).run(ActuatorModel(RIG))
        named = {name: rows[:, CHANNELS.index(name)] for name in
                 ("motor_angle_rad", "load_angle_rad", "current_A", "torque_Nm")}  # fmt: skip
        deflection = named["motor_angle_rad"] / RIG.gear_ratio - named["load_angle_rad"]
        columns = {"time_s": TIME_s, "duty": DUTY, **named, "spring_deflection_rad": deflection}
        recordings.append(
            Recording(file=f"{kind}.csv", load=load, columns=columns, sample_time_s=0.002)
        )
    return Case(name="made", folder=Path(), rig=RIG, recordings=tuple(recordings))


CASE = nominal_case()
COGGING = cogging(typical_magnitudes_of(CASE), (6, 12, 5))
LAWS = catalogue(CASE) | {law.key: law for law in (unbalance(1.0), COGGING)}
FEW = {key: law for key, law in LAWS.items()
       if law.effect not in ("motor-cogging", "load-flexibility")
       or law.law in ("6 per turn", COGGING.law, "one mode")}  # fmt: skip


def values_of(law) -> dict[str, float]:
    """Values with which the law acts: none of its unknowns at zero."""
    numbers = [
        v or 5.0 * parameter.scale for parameter, v in zip(law.unknowns, law.starts[0], strict=True)
    ]
    values = law.values(np.array(numbers))
    if law.effect == "spring-contact":
        for name in values.keys() & {"onset_rad", "onset_backward_rad", "round_rad"}:
            values[name] *= 0.3  # within what every recording here reaches
    return values


def found(law) -> FoundModel:
    return FoundModel(rig=RIG, contact={}, laws=((law, values_of(law)),), ambient_C=22.0)


def law_readings(law, load: Load, names) -> np.ndarray:
    """By the fit's own kernel, as a diagnosis replays a recording."""
    replay = replay_of(load)
    base = replay.numbers(ActuatorModel(RIG))
    where = RunConditions(
        index=0, file="r.csv", kind=load.kind, ratio=RIG.gear_ratio, session_s=0.0,
        case_rise_K=0.0, time_s=TIME_s,
    )  # fmt: skip
    trial = TrialMachine(
        plant=base.plant.copy(), fx=np.zeros(N_EFFECTS), stiffness=RIG.spring_stiffness_Nm_per_rad
    )
    law.write(values_of(law), trial, where)
    trial.start_load_rad = 0.0  # here the machine starts where it is, not where a reading puts it
    return predict_readings(replay, [trial], names, where)[0]


@pytest.mark.parametrize("key", FEW)
def test_a_law_and_its_term_are_one_machine_in_the_fixed_step_engine(key):
    law = FEW[key]
    mapped = map_laws(RIG, found(law).laws, ambient_C=22.0, contact={})
    assert mapped.left_out == ()
    (term,) = mapped.terms
    assert (term.effect, term.subsystem) == (law.effect, law.subsystem)
    if term.port is Port.SENSOR:
        return
    kind = "contact" if law.effect == "contact-nonlinear" else "pendulum"
    names = ("motor_angle_rad", "load_angle_rad", "current_A", "torque_Nm")
    by_law = law_readings(law, LOADS[kind], names)
    rows = replay_of(LOADS[kind]).run(ActuatorModel(RIG, (term,)))
    plain = replay_of(LOADS[kind]).run(ActuatorModel(RIG))
    by_term, nominal = (r[:, [CHANNELS.index(n) for n in names]] for r in (rows, plain))
    span = np.ptp(by_law, axis=0)
    assert np.max(np.abs(by_term - by_law) / span) < ROUND_OFF
    assert np.max(np.abs(by_term - nominal) / span) > 1e-5  # it does act


@pytest.mark.parametrize(
    "key",
    ["gear-friction/stribeck", "spring-hysteresis/two slips", "gear-backlash/play",
     "gear-backlash/play, wheel", "drive-thermal/winding and case",
     "load-flexibility/one mode", "spring-contact/two rounded",
     "gear-load-friction/efficiencies", "gear-load-friction/efficiencies, fading",
     "gear-friction/bristles", "load-friction/bristles", "motor-cogging/6+12+5 per turn",
     "gear-transmission-error/two harmonics"],
)  # fmt: skip
def test_a_law_and_its_term_are_one_machine_in_the_event_driven_engine(key):
    law = FEW[key]
    (term,) = map_laws(RIG, found(law).laws, ambient_C=22.0, contact={}).terms
    inputs = Inputs(time_s=TIME_s, duty=DUTY, load=LOADS["pendulum"])
    run = simulate(ActuatorModel(RIG, (term,)), inputs)
    names = ("motor_angle_rad", "load_angle_rad", "torque_Nm")
    by_law = law_readings(law, LOADS["pendulum"], names)
    exact = np.stack([getattr(run, name) for name in names], axis=1)
    assert np.max(np.abs(exact - by_law) / np.ptp(exact, axis=0)) < STEPPING


@pytest.mark.parametrize("key", [key for key, law in FEW.items() if law.sensor == "load_angle_rad"])
def test_a_law_of_a_sensor_is_read_alike_by_a_simulation(key):
    law = FEW[key]
    (term,) = map_laws(RIG, found(law).laws, ambient_C=22.0, contact={}).terms
    exact = Rig.from_tables({"rig": {k: v for k, v in _table(RIG).items() if "encoder" not in k}},
                            where="rig")  # fmt: skip
    run = simulate(
        ActuatorModel(exact, (term,)), Inputs(time_s=TIME_s, duty=DUTY, load=LOADS["pendulum"])
    )
    read, by_law = readings(run)["load_angle_rad"], law_readings(law, run.load, [law.sensor])[:, 0]
    # a delay is a cubic between rows in the simulation, straight in the fit
    assert np.max(np.abs(read - by_law)) < 2e-3 * np.ptp(read)


def _table(rig: Rig) -> dict:
    import tomllib

    return tomllib.loads(rig.to_toml())["rig"]


@pytest.mark.parametrize("key", LAWS)
def test_the_file_of_a_found_law_is_read_back_to_the_bit(tmp_path, key):
    model = found(LAWS[key])
    path = tmp_path / "model.toml"
    path.write_text(model.to_toml(), encoding="utf-8")
    again = FoundModel.from_toml(path)
    assert again.to_toml() == model.to_toml()
    held = read_model_file(path)
    terms = [term for term in held.mapped.terms if term is not None]
    assert list(read_model(path).terms) == terms
    (tmp_path / "terms.toml").write_text(model_to_toml(held.model), encoding="utf-8")
    assert read_model(tmp_path / "terms.toml") == held.model


def test_what_belongs_to_recordings_is_put_aside_and_reported(tmp_path):
    law = disturbance("rec2.csv", 1, (0.5, 0.25, 3.0), 1.0, 10.0)
    contact = {"contact_stiffness_Nm_per_rad": 1.25, "contact_angle_rad": 0.004}
    values = law.values(np.array(law.starts[0]))
    model = FoundModel(rig=RIG, contact=contact, laws=((law, values),), ambient_C=25.0)
    path = tmp_path / "model.toml"
    path.write_text(model.to_toml(), encoding="utf-8")
    held = read_model_file(path)
    assert held.model.terms == ()
    notes = " ".join(held.notes)
    assert "rec2.csv alone" in notes
    assert "[disturbance] start_s = 0.5, end_s = 0.75, peak_Nm = 3.0" in notes
    assert "multiply contact_stiffness_Nm_per_rad" in notes
    assert FoundModel.from_toml(path).to_toml() == model.to_toml()


def test_a_value_that_no_term_can_have_is_left_out_and_reported():
    law = LAWS["gear-friction/coulomb"]
    mapped = map_laws(RIG, ((law, {"coulomb_Nm": 2e9}),), ambient_C=25.0, contact={})
    assert mapped.terms == (None,)
    assert "is outside" in mapped.left_out[0]


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('law = "coulomb"', 'law = "colomb"', "unknown law 'gear-friction/colomb'"),
        ("coulomb_Nm =", "coulom_Nm =", "unknown key 'coulom_Nm'"),
        ("ambient_C =", "ambiant_C =", "unknown key 'ambiant_C'"),
    ],
)
def test_a_misspelt_file_is_refused_with_the_nearest_name(tmp_path, old, new, says):
    path = tmp_path / "model.toml"
    text = found(LAWS["gear-friction/coulomb"]).to_toml()
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(RigError, match=says):
        FoundModel.from_toml(path)


def test_a_term_written_next_to_the_laws_acts_in_predictions_and_simulations(tmp_path):
    model = found(LAWS["gear-friction/coulomb"])
    path = tmp_path / "model.toml"
    more = '\n[[term]]\neffect = "load-drag"\ntorque_at_5_rad_per_s_Nm = 0.5\n'
    path.write_text(model.to_toml() + more, encoding="utf-8")
    again = FoundModel.from_toml(path)
    assert [t.effect for t in again.terms] == ["load-drag"]
    assert [t.effect for t in read_model(path).terms] == ["gear-friction", "load-drag"]


DRY = {
    "presliding": {"coulomb_Nm": 0.03, "presliding_rad": 0.04},
    "stribeck": {"coulomb_Nm": 0.03, "stribeck_rise": 0.3, "stribeck_velocity_rad_per_s": 4.0},
    "bristles": {
        "coulomb_Nm": 0.03, "stribeck_rise": 0.3, "stribeck_velocity_rad_per_s": 4.0,
        "bristle_rad": 0.03, "asymmetry": 0.1, "bristle_damping_Nms_per_rad": 0.004,
    },
}  # fmt: skip
THREAD = {
    "efficiencies": {"drive_efficiency": 0.8, "backdrive_efficiency": 0.7},
    "efficiencies, bristles": {
        "drive_efficiency": 0.8, "backdrive_efficiency": 0.7, "bristle_rad": 0.015,
    },
    "efficiencies, fading": {
        "drive_efficiency": 0.8, "backdrive_efficiency": 0.7, "bristle_rad": 0.015,
        "stribeck_rise": 0.2, "stribeck_velocity_rad_per_s": 10.0,
    },
}  # fmt: skip


@pytest.mark.parametrize("thread_last", [False, True])
@pytest.mark.parametrize("thread", THREAD)
@pytest.mark.parametrize("dry", DRY)
def test_two_laws_of_a_gears_friction_are_one_machine_whichever_came_last(dry, thread, thread_last):
    known = laws_by_key()
    pair = [
        (known[f"gear-friction/{dry}"], DRY[dry]),
        (known[f"gear-load-friction/{thread}"], THREAD[thread]),
    ]
    laws = pair if thread_last else pair[::-1]
    mapped = map_laws(RIG, laws, ambient_C=25.0, contact={})
    assert mapped.left_out == ()
    assert mapped.aside == ()
    replay = replay_of(LOADS["pendulum"])
    base = replay.numbers(ActuatorModel(RIG))
    where = RunConditions(
        index=0, file="r.csv", kind="pendulum", ratio=RIG.gear_ratio, session_s=0.0,
        case_rise_K=0.0, time_s=TIME_s,
    )  # fmt: skip
    trial = TrialMachine(plant=base.plant.copy(), fx=np.zeros(N_EFFECTS), stiffness=1.0)
    for law, values in laws:
        law.write(values, trial, where)
    by_terms = ActuatorModel(RIG, mapped.terms).effects("duty", LOADS["pendulum"])
    stays = [place_of(n) for n in names() if n not in ("any", "internal_states", "wheel_dry")]
    np.testing.assert_allclose(by_terms[stays], trial.fx[stays], rtol=1e-14)
