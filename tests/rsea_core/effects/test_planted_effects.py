"""A planted effect runs alike in both engines, is named, fitted, written and predicted."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core import ActuatorModel, Inputs, Load, Replay, simulate
from rsea_core.effects.base import Term
from rsea_core.effects.load_friction import LoadFriction
from rsea_core.effects.load_friction_angle import LoadFrictionAngle
from rsea_core.identify.diagnose import diagnose
from rsea_core.model.model_file import read_model
from rsea_core.recordings.case import Case
from tests.cases.planted import RIG, planted, recording

PLANTED = {
    "load-friction": LoadFriction(coulomb_Nm=0.1),
    "load-friction-angle": LoadFrictionAngle(coulomb_Nm=0.2, share=0.8, phase_rad=0.3),
}
TIME_s = 2e-3 * np.arange(1500)
# a motion that no recording had
UNSEEN = Inputs(
    time_s=TIME_s,
    duty=0.4 * np.sin(2.5 * TIME_s) + 0.05 * np.sin(17.0 * TIME_s + 1.0),
    load=Load(kind="pendulum"),
)


def swings(time_s: np.ndarray) -> np.ndarray:
    """A command (n,) under which the load swings over some 2 rad, and dithers."""
    return 0.6 * np.sin(1.6 * time_s) + 0.1 * np.sin(13.0 * time_s)


def recorded(tmp_path, term: Term) -> Case:
    """The planted machine's recordings, and one of a wide motion."""
    case = planted(tmp_path, term).case
    wide = recording((term,), "pendulum", "wide.csv", 3, duty=swings)
    return replace(case, recordings=(*case.recordings, wide))


def angles(model: ActuatorModel, step_s: float | None = None) -> np.ndarray:
    """Load angle (n,) of the event-driven engine, or of the fixed-step one at a step."""
    if step_s is None:
        return simulate(model, UNSEEN).load_angle_rad
    return Replay.of(UNSEEN, step_s=step_s).run(model)[:, 1]


@pytest.mark.parametrize("effect", PLANTED)
def test_both_engines_have_one_answer_with_an_error_of_second_order(effect):
    model = ActuatorModel(RIG, (PLANTED[effect],))
    exact, without = angles(model), angles(ActuatorModel(RIG))
    coarse, fine = (np.abs(angles(model, h) - exact).max() for h in (1e-3, 2.5e-4))
    assert coarse < 0.1 * 2.0 * np.pi / RIG.load_encoder_counts_per_rev
    assert coarse < 0.01 * np.abs(exact - without).max()
    assert fine < coarse / 8.0


@pytest.mark.parametrize("effect", PLANTED)
def test_a_diagnosis_names_fits_and_writes_it_and_its_file_predicts(tmp_path, effect):
    term = PLANTED[effect]
    found = diagnose(recorded(tmp_path, term), quick=True)
    assert [e["name"] for e in found.document["effects"]] == [effect]
    parameters = found.document["effects"][0]["parameters"]
    for name, value in term.comparable().items():
        assert abs(parameters[name]["value"] - value) < 3.0 * parameters[name]["std"] + 1e-9
    path = tmp_path / "model.toml"
    path.write_text(found.model.to_toml(), encoding="utf-8")
    model = read_model(path)
    assert [type(t) for t in model.terms] == [type(term)]
    exact, without = angles(ActuatorModel(RIG, (term,))), angles(ActuatorModel(RIG))
    for predicted in (angles(model), angles(model, 1e-3)):
        assert np.std(predicted - exact) < 0.1 * np.std(without - exact)
