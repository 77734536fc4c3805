"""A case that ran to its end counts; interrupted it is not filed, crashed it is run again."""

import json
import threading
import time

import pytest

from dftfs.proof.running import Children, is_finished, run_case

ENDS = {
    "finished": "raise SystemExit(3)",
    "crashed": "import os; os.kill(os.getpid(), 9)",
    "interrupted": "raise SystemExit(130)",
}


@pytest.fixture
def case(tmp_path):
    (tmp_path / "case").mkdir()
    (tmp_path / "case" / "rig.toml").write_text("[rig]")
    return tmp_path / "case"


@pytest.mark.parametrize("state", ENDS)
def test_the_end_of_the_process_decides_how_a_case_is_filed(case, tmp_path, state):
    target = tmp_path / "filed"
    outcome = run_case(case, target, (f"{{python}} -c '{ENDS[state]}'", "true"), 30.0)
    assert outcome["state"] == state
    assert target.exists() == (state != "interrupted")
    assert is_finished(target) == (state == "finished")
    if state == "crashed":  # the next call runs it again and replaces it
        run_case(case, target, (f"{{python}} -c '{ENDS['finished']}'", "true"), 30.0)
        assert json.loads((target / "outcome.json").read_text())["state"] == "finished"


def test_a_run_that_is_stopped_ends_its_processes_and_files_nothing(case, tmp_path):
    children, begun = Children(), time.monotonic()
    threading.Timer(1.0, children.stop).start()
    command = "{python} -c 'import time; time.sleep(60)'"
    outcome = run_case(case, tmp_path / "filed", (command, "true"), 60.0, children)
    assert outcome["state"] == "interrupted"
    assert not (tmp_path / "filed").exists()
    assert time.monotonic() - begun < 20.0
