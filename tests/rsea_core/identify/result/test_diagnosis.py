"""A diagnosis shows itself in a few lines, is saved whole, and hands back its machine."""

import json
import pickle

import numpy as np
import pytest

import rsea_core
from rsea_core.effects.known_variants import laws_by_key
from rsea_core.files.csv_columns import write_columns
from rsea_core.identify.result.corrected_model import FoundModel
from rsea_core.identify.result.diagnosis import Diagnosis
from rsea_core.recordings.case import read_test
from rsea_core.recordings.recording import Recording

TIME_s = np.arange(100) / 500.0
DUTY = 0.2 * np.sin(20.0 * TIME_s)
LAW = laws_by_key()["gear-friction/coulomb"]
EFFECT = {
    "name": "gear-friction", "subsystem": "gear", "confidence": 0.934, "law": "coulomb",
    "parameters": {
        "coulomb_Nm": {"value": 0.030001, "std": 0.00123, "unit": "Nm", "at_bound": False},
        "recording": {"value": "rec1.csv", "std": None, "unit": "-", "at_bound": False},
    },
    "class": ["gear-friction", "load-friction"], "alternatives": [],
}  # fmt: skip


def diagnosis(*, findings=(), asked=None, effects=(EFFECT,), **more) -> Diagnosis:
    document = {
        "schema": 1, "verdict": "missing-physics", "summary": "Missing physics: friction.",
        "effects": list(effects), "next_experiment": asked, "findings": list(findings),
        "fit": {"recordings": [{"nrmse_before": np.float64(np.inf)}]},
    }  # fmt: skip
    model = FoundModel(
        rig=rsea_core.Rig.preset("rsea-bench"), contact={}, laws=((LAW, {"coulomb_Nm": 0.03}),)
    )
    return Diagnosis(document=document, model=model, conclusion=None, **more)


def test_it_prints_verdict_effects_with_confidence_and_figures_and_notes():
    found = diagnosis(findings=["the supply sank"], asked={"sentence": "lock the load"})
    assert str(found).splitlines() == [
        "missing-physics: Missing physics: friction.",
        "  gear-friction (gear), confidence 0.93: coulomb_Nm = 0.03 +- 0.0012,"
        " recording = rec1.csv; not",
        "    distinguished from load-friction",
        "note: the supply sank",
        "record next: lock the load",
    ]
    assert (found.verdict, found.summary) == ("missing-physics", "Missing physics: friction.")
    assert found.effects == [EFFECT]
    assert found.next_experiment == {"sentence": "lock the load"}


def test_many_findings_are_cut_to_a_few_lines():
    shown = repr(diagnosis(findings=[f"finding {k} " + 60 * "long " for k in range(30)]))
    assert max(map(len, shown.splitlines())) <= 100
    assert 'and 22 more notes, in document["findings"]' in shown


def test_recordings_of_a_case_are_shown_by_their_files(tmp_path):
    columns = {"time_s": TIME_s, "torque_Nm": DUTY}
    recordings = tuple(
        Recording(file=f"rec{k}.csv", columns=columns, sample_time_s=2e-3) for k in (1, 2)
    )
    rig = rsea_core.Rig.preset("rsea-bench")
    case = rsea_core.Case(name="c", folder=tmp_path, rig=rig, recordings=recordings)
    assert "2 of: Recording 'rec1.csv', Recording 'rec2.csv'" in repr(case)


def test_it_is_saved_whole_and_leaves_none_of_an_older_diagnosis(tmp_path):
    folder = tmp_path / "new" / "found"
    columns = {"time_s": TIME_s, "duty": DUTY}
    asked = diagnosis(
        next_columns=columns, next_recording="[[recording]]\n", unexplained_columns=columns
    )
    names = {"diagnosis.json", "model.toml", "next.csv", "next.toml", "remainder.csv"}
    assert set(asked.save(folder)) == names == {p.name for p in folder.iterdir()}
    paths = diagnosis().save(str(folder))
    assert set(paths) == {"diagnosis.json", "model.toml"} == {p.name for p in folder.iterdir()}
    document = json.loads(paths["diagnosis.json"].read_text(encoding="utf-8"))
    assert document["fit"]["recordings"] == [{"nrmse_before": None}]
    assert paths["model.toml"].read_text(encoding="utf-8") == asked.model.to_toml()


def test_its_machine_is_simulated_with_the_laws_found(tmp_path):
    found = diagnosis()
    machine = found.actuator_model()
    (term,) = machine.terms
    assert (term.effect, term.coulomb_Nm) == ("gear-friction", 0.03)
    assert machine == rsea_core.read_model(found.save(tmp_path)["model.toml"])
    inputs = rsea_core.Inputs(time_s=TIME_s, duty=DUTY, load=rsea_core.Load(kind="locked"))
    plain = rsea_core.simulate(rsea_core.ActuatorModel(machine.rig), inputs)
    run = rsea_core.simulate(machine, inputs)
    assert np.ptp(run.torque_Nm) < 0.97 * np.ptp(plain.torque_Nm)
    for other in (found, found.model):
        with pytest.raises(rsea_core.InputError, match=r"give an ActuatorModel.*actuator_model"):
            rsea_core.simulate(other, inputs)


def test_predictions_are_those_of_the_file_that_it_saves(tmp_path):
    for name, size in (("slow.csv", 1.0), ("fast.csv", 2.0)):
        write_columns(tmp_path / name, {"time_s": TIME_s, "duty": size * DUTY})
    table = '[[recording]]\nfile = "{}"\nload = "locked"\n'
    text = "".join(map(table.format, ("slow.csv", "fast.csv")))
    (tmp_path / "test.toml").write_text(text, encoding="utf-8")
    found = diagnosis()
    path = found.save(tmp_path / "found")["model.toml"]
    of_file, of_data = rsea_core.predict(path, tmp_path), rsea_core.predict(found, str(tmp_path))
    assert list(of_file) == list(of_data) == ["slow.csv", "fast.csv"]
    model = FoundModel.from_toml(path)
    for test in read_test(tmp_path, model.rig):
        for name, values in model.predict(test).items():
            assert np.array_equal(of_file[test.file][name], values)
            assert np.array_equal(of_data[test.file][name], values)
    prediction = of_data["fast.csv"]
    assert "torque_Nm" in prediction
    assert next(iter(prediction.named_columns())) == "time_s"
    assert repr(prediction).startswith("Prediction\n  file: 'fast.csv'")
    with pytest.raises(rsea_core.InputError, match="ActuatorModel is neither a Diagnosis nor"):
        rsea_core.predict(found.actuator_model(), tmp_path)


def test_it_can_be_pickled():
    again = pickle.loads(pickle.dumps(diagnosis(effects=())))
    assert again.verdict == "missing-physics"
    assert again.report_data() == {}
