"""What no effect explains becomes a table where it follows a state, and only there."""

import numpy as np
import pytest

from rsea_core.effects.layout import EFFECTS, N_EFFECTS
from rsea_core.effects.registry import LoadPositionTorque
from rsea_core.effects.residual_table import (
    EFFECT,
    PLACE,
    SPEED,
    TURN,
    VALUE,
    error_of,
    nodes_of,
    place_law,
)
from rsea_core.effects.variant import RunConditions, TrialMachine
from rsea_core.errors import RigError
from rsea_core.identify.fitting.least_squares import Fit
from rsea_core.identify.judgement.residual import unexplained_residual
from rsea_core.identify.result.conclusion import Conclusion
from rsea_core.identify.result.corrected_model import FoundModel
from rsea_core.identify.result.effect_curves import law_curves
from rsea_core.identify.selection.criteria import NOISE_MSNI
from rsea_core.model.diagnosed_effects import read_laws
from rsea_core.model.model_file import read_model_file
from tests.cases.planted import misread, parameters_of, planted

SHARE, FAST = 0.03, 15.0  # counts lost of motion above a speed [rad/s]


def lost(t, c):
    speed = np.gradient(c["motor_angle_rad"], t)
    step = np.diff(c["motor_angle_rad"], prepend=c["motor_angle_rad"][:1])
    return -SHARE * np.cumsum(step * (np.abs(speed) > FAST))


def faded(t, c):
    torque = c["torque_Nm"]
    return torque / (1.0 + (torque / 2.0) ** 2 / 3.0) - torque


def eccentric(t, c):
    return 0.01 * np.sin(30.0 * c["load_angle_rad"])


@pytest.mark.parametrize(
    ("column", "error", "law"),
    [
        ("torque_Nm", faded, VALUE),
        ("load_angle_rad", eccentric, VALUE),
        ("motor_angle_rad", lost, SPEED),
    ],
)
def test_a_reading_that_errs_by_its_own_state_is_tabulated_down_to_the_noise(
    tmp_path, column, error, law
):
    left = unexplained_residual(parameters_of(misread(tmp_path, column, error)))
    assert left.subsystem == f"sensor:{column}"
    (found,) = left.table.fit.hypothesis.laws
    assert (found.law, found.sensor) == (law, column)
    assert np.all(left.table.fit.msni < NOISE_MSNI)
    assert left.table.held_out > 0.5
    if column == "torque_Nm":
        at = nodes_of(_values(left.table.fit, found))
        inside = np.abs(at[0]) < 1.5
        apart = (at[1] - faded(None, {"torque_Nm": at[0]}))[inside]
        scale = np.polyfit(at[0][inside], apart, 1)  # the scale of all torques rests on priors
        assert np.abs(scale[0]) < 0.1
        assert np.abs(apart - np.polyval(scale, at[0][inside])).max() < 0.02


def _values(fit: Fit, law) -> dict:
    """Values of a fit's only law."""
    free = [parameter for parameter in law.unknowns if parameter.scale > 0.0]
    numbers = fit.x[-len(free) :] * [parameter.scale for parameter in free]
    fixed = {
        parameter.name: value for parameter, value in zip(law.unknowns, law.starts[0], strict=True)
    }
    return fixed | {parameter.name: float(v) for parameter, v in zip(free, numbers, strict=True)}


def test_a_torque_by_place_is_tabulated_drawn_and_read_back_as_a_term(tmp_path):
    bump = 0.2 * np.exp(-0.5 * ((np.linspace(-0.3, 0.3, 32) - 0.05) / 0.04) ** 2)
    magnet = LoadPositionTorque(first_rad=-0.3, last_rad=0.3, node_Nm=bump)
    search = parameters_of(planted(tmp_path, magnet))
    left = unexplained_residual(search)
    assert left.subsystem == "load"
    assert np.all(left.table.fit.msni < NOISE_MSNI)
    search.best = search.parameters
    conclusion = Conclusion(search)
    assert conclusion.verdict == "unexplained"
    laws = tuple(zip(conclusion.fit.hypothesis.laws, conclusion.laws, strict=True))
    assert [law.law for law, _ in laws] == [PLACE]
    (curve,) = law_curves(conclusion)
    at = np.abs(curve["x"] - 0.05) < 0.1
    truth = np.interp(curve["x"], np.linspace(-0.3, 0.3, 32), bump)
    added = curve["found"] - curve["nominal"]
    assert added[at] == pytest.approx(truth[at], abs=0.06)
    assert np.all(curve["high"] >= curve["low"])
    path = tmp_path / "model.toml"
    path.write_text(FoundModel(rig=conclusion.rig(), contact={}, laws=laws).to_toml())
    (term,) = read_model_file(path).model.terms
    assert isinstance(term, LoadPositionTorque)
    assert term.node_Nm == pytest.approx(nodes_of(conclusion.laws[0])[1])


def test_an_error_that_follows_no_state_has_no_table(tmp_path):
    search = parameters_of(
        misread(
            tmp_path, "torque_Nm",
            lambda t, c: 0.5 * np.sin(2.0 * np.pi * 0.9 * t + 0.4) * (np.floor(t / 0.3) % 3 == 1),
        )
    )  # fmt: skip
    left = unexplained_residual(search)
    assert left.subsystem == "sensor:torque_Nm"
    assert left.table is None


def test_tables_of_readings_by_hand():
    places, entries = np.array([0.0, 1.0, 2.0]), np.array([0.0, 0.2, 0.0])
    y, t = np.array([-1.0, 0.5, 1.0, 3.0]), np.arange(4.0)
    assert error_of(VALUE, places, entries, y, t) == pytest.approx([0.0, 0.1, 0.2, 0.0])
    grown = error_of(VALUE, places, entries, y, t, grows=True)
    assert grown == pytest.approx([-0.2, 0.1, 0.2, -0.2])
    turn = error_of(TURN, places, np.array([0.0, 0.3]), np.pi * np.array([0.5, 1.0, 2.5]), t)
    assert turn == pytest.approx([0.15, 0.3, 0.15])
    even = error_of(SPEED, places, np.array([0.0, -0.1, -0.1]), 1.5 * t, t)
    assert even == pytest.approx(-0.15 * t)


def test_a_table_of_the_load_is_the_terms_law():
    nodes = np.linspace(-1.0, 1.0, 32)
    term = LoadPositionTorque(first_rad=-0.2, last_rad=0.42, node_Nm=nodes)
    law = place_law((-0.2, 0.42), 1.0)
    values = {"first": -0.2, "last": 0.42} | {f"at_{j}": v for j, v in enumerate(nodes, 1)}
    trial = TrialMachine(plant=np.zeros(22), fx=np.zeros(N_EFFECTS), stiffness=1.0)
    where = RunConditions(
        index=0, file="", kind="pendulum", ratio=1.0, session_s=0.0, case_rise_K=0.0,
        time_s=np.zeros(2),
    )  # fmt: skip
    law.write(values, trial, where)
    for name, value in term.numbers(None).items():
        assert trial.fx[EFFECTS.index(name)] == pytest.approx(value)


@pytest.mark.parametrize(
    ("effect", "law", "values", "message"),
    [
        (EFFECT, VALUE, {}, "lacks first"),
        (EFFECT, VALUE, {"first": 0.0, "last": 1.0, "at_1": 0.1}, "lacks at_2"),
        (EFFECT, VALUE, {"first": 0.0, "last": 1.0, "at_1": 0.1, "at_3": 0.1}, "lacks at_2"),
        (EFFECT, VALUE, {"first": 1.0, "last": 0.0, "at_1": 0.1, "at_2": 0.1}, "below last"),
        (EFFECT, PLACE, {"first": 0.0, "last": 1.0, "at_1": 0.1, "at_2": 0.1}, "lacks at_3"),
        ("sensor-scale", "factor", {}, "lacks scale"),
        ("gear-friction", "coulomb", {}, "lacks coulomb_Nm"),
        ("gear-transmission-error", "worm", {"worm_cos_rad": 1e-3}, "lacks worm_sin_rad"),
        ("drive-saturation", "sag", {"source_resistance_ohm": -3.0}, "must not be negative"),
        (
            "load-inertia-variation",
            "harmonic",
            {"cosine_share": 3.0},
            "cosine_share = 3 is outside",
        ),
    ],
)
def test_a_law_in_a_file_that_lacks_values_or_cannot_be_is_reported_in_one_line(
    effect, law, values, message
):
    entry = {"effect": effect, "law": law, "values": values}
    if effect == "sensor-scale" or law == VALUE:
        entry["column"] = "torque_Nm"
    with pytest.raises(RigError, match=message) as refused:
        read_laws([entry], "model.toml")
    assert "\n" not in str(refused.value)
