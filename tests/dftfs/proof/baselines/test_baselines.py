"""The baselines' simulator follows the true machine; their learners find planted torques."""

import numpy as np
import pytest

from dftfs.proof.baselines.learners import FAMILY, friction, gaussian_process, sparse
from dftfs.proof.baselines.ports import Lacking, Recorded, lacking
from dftfs.proof.baselines.running import adjust, learn, misfit
from dftfs.proof.baselines.simulator import NAMES, PORTS, UNITS, dictionary, predict
from dftfs.proof.machine import LOAD_MODES, Physics
from tests.cases.proof import BARE, run

NOTHING = np.zeros((PORTS, len(NAMES)))
TIME = 1e-3 * np.arange(4000)
DUTY = 0.25 * np.sin(2 * np.pi * 0.5 * TIME) + 0.1 * np.sin(2 * np.pi * 2.3 * TIME)


def recorded(load: str, physics: Physics, duty: np.ndarray, role: str = "identification"):
    motion = run(BARE, load, duty, physics=physics, seconds=4.0).values
    names = ("motor_angle_rad", "load_angle_rad", "current_A", "torque_Nm")
    columns = {"time_s": TIME, "duty": duty} | {n: motion[n] for n in names}
    return Recorded(role=role, load=load, columns=columns)


@pytest.mark.parametrize("load", ["pendulum", "locked", "contact", "free"])
def test_nominal_free_run_follows_the_true_machine(load):
    truth = run(BARE, load, DUTY, seconds=4.0).values
    found = predict(BARE, LOAD_MODES[load], 1e-3, DUTY, np.zeros(2), NOTHING)
    for name in found:
        spread = max(truth[name].std(), 1e-9)
        assert np.sqrt(np.mean((found[name] - truth[name]) ** 2)) < 6e-3 * spread, name


def test_dictionary_has_a_column_for_every_name():
    states = np.array([[0.3, 0.5, -0.2, 0.1]])
    row = dictionary(states, np.array([0.7]), len(NAMES))[0]
    assert row[NAMES.index("deflection output-speed")] == pytest.approx(0.15)
    assert row[NAMES.index("deflection deflection link-angle")] == pytest.approx(0.009)
    assert row[NAMES.index("output-square")] == pytest.approx(0.25)
    assert row[NAMES.index("output-stribeck-0.5")] == pytest.approx(np.exp(-1.0))
    assert row[NAMES.index("cos 2")] == pytest.approx(np.cos(1.4))
    assert np.isfinite(row).all()


def planted(rng: np.random.Generator) -> Lacking:
    states = rng.normal(size=(3000, 4))
    motor = rng.uniform(0, 6, 3000)
    output = 0.8 * np.tanh(states[:, 1] / 0.02) + 0.3 * states[:, 1]
    spring = 2.0 * states[:, 0] ** 3
    noise = 0.01 * rng.normal(size=(2, 3000))
    unknown = np.full(3000, np.nan)
    torques = np.column_stack([output + noise[0], spring + noise[1], unknown])
    return Lacking(states=states, motor_angle=motor, torques=torques)


def test_sparse_regression_finds_the_planted_terms_and_no_others():
    learned = sparse(planted(np.random.default_rng(2)), 0.1)
    kept = [{NAMES[k] for k in np.flatnonzero(w)} for w in learned.weights]
    assert kept[0] == {"output-sign", "output-speed"}
    assert kept[1] == {"deflection deflection deflection"}
    assert kept[2] == set()
    assert learned.weights[0, NAMES.index("output-sign")] == pytest.approx(0.8, rel=0.02)


def test_gaussian_process_predicts_a_smooth_planted_torque():
    rng = np.random.default_rng(3)
    states = rng.normal(size=(2000, 4)) * [1.0, 0.1, 0.1, 0.1]
    target = np.sin(states[:, 0])
    torques = np.column_stack([target, np.zeros(2000), np.full(2000, np.nan)])
    data = Lacking(states=states, motor_angle=np.zeros(2000), torques=torques)
    learned = gaussian_process(data, rng)
    apart = ((states[:200, None] - learned.centres[None]) ** 2).sum(-1)
    found = np.exp(-0.5 * apart / learned.length**2) @ learned.weights[0]
    assert np.sqrt(np.mean((found - target[:200]) ** 2)) < 0.05


def test_friction_law_reads_the_coulomb_torque_off_a_recording():
    level = 0.03
    physics = Physics(gear_coulomb_plus_Nm=level, gear_coulomb_minus_Nm=level)
    found = friction(lacking(BARE, recorded("pendulum", physics, DUTY)), "M1")
    value = found.weights[0, NAMES.index("output-sign")]
    assert value == pytest.approx(level * BARE.gear_ratio, rel=0.05)


def test_constants_are_found_again_when_nothing_is_missing():
    truth = recorded("pendulum", Physics(), DUTY)
    wrong = BARE._replace(torque_constant_Nm_per_A=0.32, load_viscous_Nms_per_rad=0.03)
    nothing = friction(lacking(BARE, truth), "M1")
    nothing = type(nothing)(name="nothing", weights=NOTHING)
    before = misfit(wrong, [truth], nothing)
    after = misfit(adjust(wrong, [truth], nothing), [truth], nothing)
    assert after < 0.2 * before


def test_friction_family_improves_the_free_run_of_a_machine_with_friction():
    physics = Physics(gear_coulomb_plus_Nm=0.03, gear_coulomb_minus_Nm=0.03)
    parts = [
        recorded("pendulum", physics, DUTY),
        recorded("locked", physics, 0.4 * DUTY),
        recorded("pendulum", physics, 0.8 * DUTY[::-1], role="validation"),
    ]
    found = learn(BARE, parts, seed=1)
    plain = friction(lacking(BARE, parts[0]), "M1")
    nothing = type(plain)(name="nothing", weights=NOTHING)
    machine, law = found["friction-family"]
    assert law.name in FAMILY
    assert misfit(machine, [parts[2]], law) < 0.4 * misfit(BARE, [parts[2]], nothing)
    assert np.all(UNITS > 0)
