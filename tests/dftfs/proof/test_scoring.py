"""Scores are those of the practice set's own script, and figures have their known answers."""

import json
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from dftfs.proof.making import composition, counts
from dftfs.proof.recipes import EFFECTS, LEVELS
from dftfs.proof.report import interval_table
from dftfs.proof.scoring import comparable, gain, score_case
from dftfs.proof.summary import Rate, calibration, detection, half_point, summarise
from tests.cases.places import SHARED_DATA

PRACTICE = SHARED_DATA / "practice"
needs_practice = pytest.mark.skipif(
    not (PRACTICE / "score.py").is_file(), reason="../shared/data/practice is not here"
)


@needs_practice
@pytest.mark.parametrize("kind", ["oracle", "nothing", "parameters", "everything"])
def test_practice_diagnoses_score_as_the_practice_script_scores_them(kind, tmp_path):
    arguments = ["--labels", PRACTICE / "labels.json", "--hidden", PRACTICE / "hidden"]
    arguments += ["--diagnoses", tmp_path, "--predictions", tmp_path, f"--make-{kind}", tmp_path]
    arguments += ["--json", tmp_path / "score.json", "--quiet"]
    subprocess.run(
        [sys.executable, PRACTICE / "score.py", *arguments], check=True, capture_output=True
    )
    theirs = json.loads((tmp_path / "score.json").read_text())
    labels = json.loads((PRACTICE / "labels.json").read_text())
    ours = summarise(
        [
            score_case(
                case,
                label,
                json.loads((tmp_path / case / "diagnosis.json").read_text()),
                PRACTICE / "hidden" / case,
                tmp_path / case / "prediction.csv",
            )
            for case, label in labels.items()
        ]
    )
    pairs = {
        "verdict": ours.verdict,
        "location": ours.location,
        "top1": ours.top1,
        "precision": ours.precision,
        "recall": ours.recall,
        "false_alarm_null": ours.false_alarm,
        "hidden_fraction": ours.gain,
        "hidden_fraction_beyond_parameters": ours.gain_beyond,
        "brier": ours.calibration.brier if ours.calibration else None,
        "rivals_named": ours.rivals_named,
    }
    for name, mine in pairs.items():
        value = mine.share if isinstance(mine, Rate) else mine
        if value is None:
            assert np.isnan(theirs[name]), name
        else:
            assert value == pytest.approx(theirs[name], abs=1e-12), name


def test_calibration_of_right_and_wrong_confidences():
    honest = calibration([(0.75, True)] * 3 + [(0.75, False)])
    assert honest.expected_error == pytest.approx(0.0)
    assert honest.brier == pytest.approx(0.75 * 0.25)
    boasting = calibration([(0.95, False)] * 4)
    assert boasting.expected_error == pytest.approx(0.95)
    assert calibration([]) is None


def test_half_point_of_a_known_detection_curve():
    rng = np.random.default_rng(1)
    strength = np.exp(rng.uniform(np.log(1), np.log(100), 4000))
    chance = 1.0 / (1.0 + (strength / 8.0) ** -2.0)
    pairs = list(zip(strength, rng.random(4000) < chance, strict=True))
    assert half_point(pairs) == pytest.approx(8.0, rel=0.1)
    assert sum(row[3] for row in detection(pairs)) == (strength >= 1.5).sum()
    assert half_point([(2.0, True)] * 20) is None
    one_missed = [(float(s), s != 20) for s in range(2, 60)]
    assert half_point(one_missed) is None, "no case was as weak as where half would be found"


def test_wilson_interval_of_no_alarm_in_fifty():
    rate = Rate.of([0.0] * 50)
    assert (rate.share, rate.low) == (0.0, 0.0)
    assert rate.high == pytest.approx(0.0713, abs=1e-3)  # Wilson 1927 at z = 1.96


def test_gain_counts_only_channels_with_room():
    rows = {
        "a": {"nominal": 0.5, "refit": 0.3, "floor": 0.1, "predicted": 0.2},
        "b": {"nominal": 0.1005, "refit": 0.1, "floor": 0.1, "predicted": 0.1},
    }
    assert gain(rows, "nominal") == pytest.approx(0.75)
    assert gain(rows, "refit") == pytest.approx(0.5)


def test_composition_fills_every_level_and_deals_every_effect():
    recipes = composition(120, 3)
    assert len(recipes) == 120
    size = counts(120)
    assert sum(size.values()) == 120
    assert all(size[level] >= 5 for level in LEVELS)
    single = {r.effects[0] for r in recipes if r.level in ("plain", "concealed")}
    assert single == set(EFFECTS)
    assert composition(120, 3) == recipes
    assert composition(120, 4) != recipes


def test_the_report_lists_the_intervals_that_miss_and_no_others():
    truth = {"gear-friction": {"coulomb_Nm": 0.02}, "gear-backlash": {"width_rad": 0.01}}
    values = {"gear-friction": ("coulomb_Nm", 0.015), "gear-backlash": ("width_rad", 0.0102)}
    effects = [
        {"name": name, "confidence": 0.9, "parameters": {key: {"value": value, "std": 0.001}}}
        for name, (key, value) in values.items()
    ]
    compared = comparable({"parameters": truth}, {"effects": effects})
    score = SimpleNamespace(case="case-001", parameters=compared)
    rows = interval_table([score]).rows
    assert rows == [("gear-friction", "coulomb_Nm", "case-001", "0.02", "0.015", "-5.0")]
