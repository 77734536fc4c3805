"""An effect of a user's own file is simulated by both engines, found by a diagnosis, predicted.

Registered effects stay in a process, so that each test runs in one of its own.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
TEMPLATE = ROOT / "dftfs" / "examples" / "my_effect.py"

ENGINES = """
import sys
import numpy as np
from rsea_core import ActuatorModel, Inputs, Load, Replay, Rig, simulate
from rsea_core.effects import load_effects
from rsea_core.effects.user_effects import speed_note
kind = load_effects(sys.argv[1])[0]
time = np.arange(500) * 2e-3
inputs = Inputs(time_s=time, duty=0.1 * np.sin(6.0 * time), load=Load(kind="pendulum"))
model = ActuatorModel(Rig.preset("rsea-bench"), (kind(level_Nm=0.3),))
plain = simulate(ActuatorModel(model.rig), inputs).load_angle_rad
event = simulate(model, inputs).load_angle_rad
assert not model.kept  # another function may stand behind the effect in the next run
fixed = Replay.of(inputs).run(model)[:, 1]
print(np.ptp(plain), np.abs(event - plain).max(), np.abs(fixed - event).max(), speed_note())
"""

PLANTED = """
import sys
from pathlib import Path
from rsea_core.effects import load_effects
from rsea_core.files.csv_columns import write_columns
from tests.cases.planted import RIG, recording
folder = Path(sys.argv[2])
term = load_effects(sys.argv[1])[0](level_Nm=0.15, speed_rad_per_s=0.4)
text = RIG.to_toml()
for seed, load in ((1, "locked"), (2, "pendulum")):
    read = recording((term,), load, f"{load}.csv", seed)
    write_columns(folder / f"{load}.csv", dict(read.columns))
    text += f'\\n[[recording]]\\nfile = "{load}.csv"\\nload = "{load}"\\nrole = "identification"\\n'
(folder / "rig.toml").write_text(text)
"""

IN_PYTHON = """
@hook("load_torque")
def cable_torque(fx, angle, speed, torque):
    law = {"level": fx[DRAG], "share": type("Share", (), {"of": lambda self, x: np.tanh(x)})()}
    return torque - law["level"] * law["share"].of(speed / fx[SPEED]) if fx[DRAG] else torque
"""


# the template's drag as a level of dry friction that depends on the angle and falls with speed
JOINT = """
@hook("load_friction")
def joint_friction(fx, angle, speed, level):
    if fx[DRAG] != 0.0:
        level += fx[DRAG] * (1.0 + 0.8 * np.sin(angle)) / (1.0 + abs(speed) / fx[SPEED])
    return level
"""

# a drag whose engine must know the speed within its step: (step, error) as the step is halved
HALVED = """
import sys
import numpy as np
from rsea_core import ActuatorModel, Inputs, Load, Replay, Rig, simulate
from rsea_core.effects import load_effects
kind = load_effects(sys.argv[1])[0]
time = np.arange(300) * 4e-3
inputs = Inputs(time_s=time, duty=0.1 * np.sin(6.0 * time), load=Load(kind="pendulum"))
model = ActuatorModel(Rig.preset("rsea-bench"), (kind(level_Nm=0.3),))
event = simulate(model, inputs).load_angle_rad
runs = [Replay.of(inputs, step_s=step).run(model)[:, 1] for step in (1e-3, 5e-4, 2.5e-4)]
print(*(np.abs(run - event).max() for run in runs))
"""


def python(code: str, *arguments: object) -> str:
    command = [sys.executable, "-c", code, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return done.stdout


def dftfs(*arguments: object) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "dftfs", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT)


@pytest.mark.parametrize("port", ["load_torque", "output_torque"])
def test_both_engines_have_the_law_compiled(tmp_path, port):
    own = tmp_path / "own.py"
    own.write_text(TEMPLATE.read_text().replace('hook("load_torque")', f'hook("{port}")'))
    span, change, apart, note = python(ENGINES, own).split(maxsplit=3)
    assert float(change) > 5e-3 * float(span)
    assert float(apart) < 0.01 * float(change)
    assert note.strip() == "None"


def changed_template(path: Path, law: str, **arguments: str) -> Path:
    """The template with another law in place of its own, and other words."""
    text = TEMPLATE.read_text()
    begin, end = text.index("@hook"), text.index("@dataclass")
    text = text[:begin] + law + "\n\n" + text[end:]
    for old, new in arguments.items():
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    return path


def test_a_law_of_the_speed_is_of_second_order():
    errors = [float(word) for word in python(HALVED, TEMPLATE).split()]
    assert errors[0] > 3.0 * errors[1]
    assert errors[1] > 3.0 * errors[2]


def test_both_engines_have_a_level_of_the_joints_friction(tmp_path):
    dry = '"cable_speed": self.speed_rad_per_s'
    own = changed_template(tmp_path / "own.py", JOINT, **{dry: dry + ', "load_dry": 1.0'})
    span, change, apart, note = python(ENGINES, own).split(maxsplit=3)
    assert float(change) > 0.01 * float(span)
    assert float(apart) < 0.01 * float(change)
    assert note.strip() == "None"


def test_a_law_that_does_not_compile_is_called_in_python_and_that_is_reported(tmp_path):
    own = changed_template(tmp_path / "own.py", IN_PYTHON)
    expected, found = python(ENGINES, TEMPLATE).split(), python(ENGINES, own).split(maxsplit=3)
    assert float(found[1]) == pytest.approx(float(expected[1]), rel=1e-9)
    assert "called in Python" in found[3]


def test_a_diagnosis_names_fits_and_writes_it_and_a_prediction_reads_it(tmp_path):
    python(PLANTED, TEMPLATE, tmp_path)
    out = tmp_path / "out"
    done = dftfs("diagnose", tmp_path, "--quick", "--effects", TEMPLATE, "--out", out, "--json")
    assert done.returncode == 0, done.stderr
    (effect,) = json.loads(done.stdout)["effects"]
    assert (effect["name"], effect["subsystem"]) == ("x-cable-drag", "load")
    level = effect["parameters"]["level_Nm"]
    assert abs(level["value"] - 0.15) < 3.0 * level["std"]
    assert "a cable drags on the load: level" in json.loads(done.stdout)["summary"]
    lacking = dftfs("predict", out / "model.toml", tmp_path)
    assert lacking.returncode == 2
    assert "x-cable-drag" in lacking.stderr


BAD_FILES = {
    "line 2: ZeroDivisionError": "x = 1\ny = 1 / 0\n",
    "line 1: SyntaxError": "def f(\n",
    "has no class that derives from rsea_core.effects.Term": "x = 1\n",
    "CableDrag lacks the class attribute headline": TEMPLATE.read_text().replace(
        'headline: ClassVar[str] = "A cable drags on the load."', ""
    ),
    "effect 'load-drag', law 'quadratic' is there already": TEMPLATE.read_text()
    .replace("x-cable", "load")
    .replace("saturating", "quadratic"),
    "numbers named load_drag are claimed already": TEMPLATE.read_text().replace(
        'slots("cable_drag"', 'slots("load_drag"'
    ),
    "port 'torque' is not one of": TEMPLATE.read_text().replace(
        'hook("load_torque")', 'hook("torque")'
    ),
}

# each file in a process of its own, forked from one that has the imports: status, then the errors
EACH_FORKED = """
import json, os, sys, tempfile
import dftfs.cli.diagnose
from dftfs.cli.main import main
found = []
for path in sys.argv[1:]:
    with tempfile.TemporaryFile("w+") as errors:
        child = os.fork()
        if child == 0:
            os.dup2(errors.fileno(), 1)
            os.dup2(errors.fileno(), 2)
            status = main(["diagnose", os.path.dirname(path), "--effects", path])
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        errors.seek(0)
        found.append((status, errors.read()))
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def refusals(tmp_path_factory) -> dict[str, tuple[int, str]]:
    """Exit status and printed text of `dftfs diagnose --effects` for each bad file."""
    folder = tmp_path_factory.mktemp("bad-files")
    paths = [folder / f"bad-{number}.py" for number in range(len(BAD_FILES))]
    for path, text in zip(paths, BAD_FILES.values(), strict=True):
        path.write_text(text)
    return dict(zip(BAD_FILES, json.loads(python(EACH_FORKED, *paths)), strict=True))


@pytest.mark.parametrize("says", BAD_FILES)
def test_a_bad_file_gets_one_clear_line(refusals, says):
    status, printed = refusals[says]
    assert status == 2
    assert len(printed.strip().splitlines()) == 1
    assert says in printed
