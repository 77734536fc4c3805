"""What a newcomer copies out of `docs/recordings.md` is read by the program."""

import re
import tomllib

import numpy as np
import pytest

from rsea_core.effects.registry import TERMS
from rsea_core.files.csv_columns import write_columns
from rsea_core.identify.candidates.rig_parameters import TOLERANCES
from rsea_core.recordings.case import read_case
from tests.cases.places import ROOT

TEXT = (ROOT / "docs" / "recordings.md").read_text(encoding="utf-8")


def test_the_rig_file_of_the_document_is_read(tmp_path):
    rig = re.search(r"```toml\n(.*?)```", TEXT, re.S).group(1)
    (tmp_path / "rig.toml").write_text(rig, encoding="utf-8")
    time = np.arange(200) * 1e-3
    columns = {"time_s": time, "duty": 0.1 * np.sin(time), "motor_angle_rad": time**2}
    write_columns(tmp_path / tomllib.loads(rig)["recording"][0]["file"], columns)
    case = read_case(tmp_path)
    assert case.rig.spring_stiffness_Nm_per_rad == 65.8
    assert [r.role for r in case.recordings] == ["identification"]


def test_its_conversion_of_a_log_runs_and_is_read(tmp_path, monkeypatch):
    code = re.search(r"```python\n(.*?)```", TEXT, re.S).group(1)
    (tmp_path / "my-case").mkdir()
    time = np.arange(50.0)
    log = np.column_stack([time, 10.0 * np.ones(50), 360.0 * time, time])
    np.savetxt(tmp_path / "log.csv", log, delimiter=",", header="ms,percent,deg,deg")
    monkeypatch.chdir(tmp_path)
    exec(compile("\n".join(line[3:] for line in code.splitlines()), "recordings.md", "exec"), {})
    rig = re.search(r"```toml\n(.*?)```", TEXT, re.S).group(1).replace("sine_1hz", "sine")
    (tmp_path / "my-case" / "rig.toml").write_text(rig, encoding="utf-8")
    r = read_case(tmp_path / "my-case").recordings[0]
    assert r["duty"][0] == pytest.approx(0.1)
    assert r["motor_angle_rad"][-1] == pytest.approx(2 * np.pi * 49, rel=1e-8)
    assert r.sample_time_s == pytest.approx(1e-3)


def test_its_names_are_those_of_the_program():
    table = TEXT[TEXT.index("### Names") :]
    effects = set(re.findall(r"^\| `([a-z-]+)` \| [a-z]", table, re.M))
    named = {effect for effect, kind in TERMS.items() if kind.headline}
    assert effects == {name for name in named if not name.startswith("sensor")}


def test_it_states_every_default_tolerance():
    for name, value in TOLERANCES.items():
        assert f"`{name}` {value:g}" in TEXT
