"""Wide sets are whole, sealed apart, resumable, and judged by finished cases alone."""

import json
import sys

import numpy as np
import pytest

from dftfs.cli.main import main
from dftfs.proof.labels import SealError, check_seal
from dftfs.proof.wide.effects_outside import OUTSIDE
from dftfs.proof.wide.machines import KINDS, draw_machine
from dftfs.proof.wide.making import composition
from dftfs.proof.wide.scores import Bound, as_labelled

GENERATOR = """
import json, pathlib, sys
seed, case, hidden = int(sys.argv[1]), *map(pathlib.Path, sys.argv[2:])
(case / "rig.toml").write_text("[rig]\\nname = 'x'\\n")
label = {"verdicts": {"parameters-only": 1.0}, "subsystems": {}, "effects": [], "level": "null",
         "effect_subsystem": {}, "nearest_names": [], "parameters": {}, "acceptable": {},
         "tolerated": {"drive-delay": "late"}, "rivals": [], "machine": "any",
         "parameters_true_vs_rig": {}, "hidden_test": {"nrmse": {}}}
(hidden / "label.json").write_text(json.dumps(label))
"""
TOOL = """
import json, pathlib, sys
case, out = map(pathlib.Path, sys.argv[1:])
mark = pathlib.Path(__file__).with_name("crash")
if mark.exists() and mark.read_text() == "yes":
    mark.write_text("no")
    sys.exit(3)
effect = {"name": "drive-delay", "subsystem": "drive", "confidence": 0.9}
found = {"verdict": "missing-physics", "effects": [effect]}
(out / "diagnosis.json").write_text(json.dumps(found))
"""


@pytest.fixture
def made(tmp_path):
    for name, text in (("generator", GENERATOR), ("tool", TOOL)):
        (tmp_path / f"{name}.py").write_text(text)
    command = f"{sys.executable} {tmp_path / 'generator.py'} {{seed}} {{case}} {{hidden}}"
    arguments = ["prove", "make", "--machines", "wide", "--count", "2", "--seed", "4"]
    assert main([*arguments, "--truth", command, "--out", str(tmp_path / "set")]) == 0
    return tmp_path


def test_a_foreign_generator_and_a_foreign_tool_are_run_resumed_and_judged(made, capsys):
    (made / "crash").write_text("yes")
    tool = f"{sys.executable} {made / 'tool.py'} {{case}} {{out}}"
    arguments = ["prove", "run", str(made / "set"), "--tool", tool]
    assert main(arguments) == 0
    report = ["prove", "report", str(made / "set"), "--json"]
    capsys.readouterr()
    assert main(report) == 0
    first = json.loads(capsys.readouterr().out)
    assert first["states"] == {"crashed": 1, "finished": 1}
    assert first["cases"] == 1
    assert main([*arguments, "--again"]) == 0
    capsys.readouterr()
    assert main([*report, "--out", str(made / "report")]) == 0
    second = json.loads(capsys.readouterr().out)
    assert second["states"] == {"finished": 2}
    assert second["null_claims"]["events"] == 0  # a late command is true of the log
    assert (made / "report" / "proof.html").is_file()


def test_a_changed_answer_breaks_the_seal(made):
    assert len(check_seal(made / "set")) == 64
    path = made / "set_sealed" / "labels.json"
    path.write_text(path.read_text() + " ")
    with pytest.raises(SealError, match="changed since it was sealed"):
        check_seal(made / "set")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--truth", "false"], "status 1"),
        (["--truth", "true {nothing}"], "known: seed, case, hidden"),
        (["--truth", "true"], "wrote no case/rig.toml"),
        (["--levels", "poor"], "wide sets have"),
    ],
)
def test_what_cannot_be_made_is_refused_in_one_line(tmp_path, capsys, arguments, message):
    base = ["prove", "make", "--machines", "wide", "--count", "1", "--seed", "1"]
    assert main([*base, "--out", str(tmp_path / "set"), *arguments]) == 2
    shown = capsys.readouterr().err
    assert message in shown
    assert "Traceback" not in shown


def test_three_cases_in_ten_are_sound_and_every_effect_has_its_turn():
    recipes = composition(100, 3)
    assert sum(r.level == "null" for r in recipes) == 30
    assert len({r.effect for r in recipes if r.level in ("plain", "concealed", "double")}) == 23


def test_bounds_are_those_of_clopper_and_pearson():
    none = Bound.of(0, 300)
    assert none.high == pytest.approx(1 - 0.05 ** (1 / 300))
    assert Bound.of(3, 10).low == pytest.approx(0.0873, abs=1e-4)
    assert Bound.of(0, 0) is None


def test_a_name_as_true_as_the_truth_stands_for_it_and_a_name_of_the_log_for_nothing():
    label = {"level": "plain", "effects": ["gear-friction"],
             "acceptable": {"load-friction": "gear-friction"},
             "tolerated": {"drive-delay": "late"}}  # fmt: skip
    found = {
        "verdict": "missing-physics",
        "effects": [
            {"name": "load-friction", "confidence": 0.9},
            {"name": "drive-delay", "confidence": 0.8},
        ],
    }
    names = [e["name"] for e in as_labelled(label, found)["effects"]]
    assert names == ["gear-friction"]
    assert np.isclose(as_labelled(label, found)["effects"][0]["confidence"], 0.9)


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_an_unnamed_law_either_changes_a_machine_or_is_not_drawn(kind):
    """A machine that cannot have it gets None, as of the laws with a name."""
    machine = draw_machine(np.random.default_rng(1), kind)
    drawn = [draw(np.random.default_rng(2), machine, None) for draw in OUTSIDE.values()]
    assert all(law is None or law(1.0).extra for law in drawn)
    assert any(law is not None for law in drawn)
