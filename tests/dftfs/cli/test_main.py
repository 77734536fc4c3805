"""`dftfs` alone is a map, a slip names the nearest match, and no error is ever a traceback."""

import builtins
import importlib.util
import os
import shlex
import signal
import subprocess
import sys
import time
from importlib.machinery import ExtensionFileLoader

import pytest

from dftfs.cli import main as program
from dftfs.cli.command_map import EXAMPLES, GROUPS
from dftfs.cli.common import progress
from dftfs.cli.endings import INTERNAL_ERROR, Ended, as_interrupts
from dftfs.cli.main import COMMANDS, SENTENCES, main


def test_alone_it_shows_every_command_and_three_first_steps(capsys):
    assert main([]) == 0
    shown = capsys.readouterr().out
    assert all(f"  {name} " in shown for name in SENTENCES)
    assert len(shown.split("to begin:")[1].strip().splitlines()) >= 4


def test_each_command_is_keyed_by_the_module_that_runs_it():
    missing = [m for m in COMMANDS if importlib.util.find_spec(f"dftfs.cli.{m}") is None]
    assert missing == []
    assert {"import", "export-log"} < SENTENCES.keys()


def test_every_command_has_a_group_and_examples_that_its_parser_takes():
    grouped = [name for names in GROUPS.values() for name in names]
    assert sorted(grouped) == sorted(set(grouped))
    assert set(grouped) <= SENTENCES.keys()
    for lines in EXAMPLES.values():
        for line in lines:
            given_arguments = shlex.split(line)[1:]
            _, unknown = program.parser(given_arguments).parse_known_args(given_arguments)
            assert not unknown, line


@pytest.mark.parametrize(
    ("given_arguments", "message"),
    [
        (["simulat", "x.toml"], "did you mean simulate?"),
        (["prove", "runn"], "did you mean run?"),
        (["tune", "x.toml", "--methd=pso"], "did you mean --method?"),
        (["new", "desing", "x.toml"], "did you mean design?"),
    ],
)
def test_a_slip_names_the_nearest_match(given_arguments, message, capsys):
    with pytest.raises(SystemExit) as end:
        main(given_arguments)
    assert end.value.code == 2
    shown = capsys.readouterr().err
    assert message in shown
    assert shown.count("\n") == 1


def test_an_internal_error_is_one_line_and_a_traceback_under_v(monkeypatch, capsys):
    def fails(arguments):
        raise TypeError("unhashable\ntype")

    monkeypatch.setattr("dftfs.cli.materials.run", fails)
    assert main(["materials"]) == INTERNAL_ERROR == 70
    shown = capsys.readouterr().err
    assert shown.count("\n") == 1
    assert "TypeError: unhashable type" in shown
    assert main(["materials", "-v"]) == 70
    assert "Traceback" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("error", "status", "message"),
    [
        (OSError(28, "No space left on device", "a.csv"), 2, "a.csv: the disk is full"),
        (PermissionError(13, "Permission denied", "b.csv"), 2, "b.csv: Permission denied"),
        (
            vars(builtins)["MemoryError"]("Unable to allocate 240 GiB"),
            3,
            "out of memory: Unable to allocate",
        ),
    ],
)
def test_what_the_machine_refuses_is_named(monkeypatch, capsys, error, status, message):
    def fails(arguments):
        raise error

    monkeypatch.setattr("dftfs.cli.materials.run", fails)
    monkeypatch.setattr(os, "dup2", lambda *a: None)
    assert main(["materials"]) == status
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_a_command_in_one_line(number):
    code = (
        "import time, dftfs.cli.materials as m; from dftfs.cli.main import main\n"
        "def run(arguments):\n    print('ready', flush=True); time.sleep(30)\n"
        "m.run = run; raise SystemExit(main(['materials']))"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "ready\n"
    begun = time.monotonic()
    process.send_signal(number)
    _, shown = process.communicate(timeout=20)
    assert time.monotonic() - begun < 10
    assert process.returncode == {signal.SIGTERM: 143, signal.SIGINT: 130}[number]
    assert shown == "dftfs materials: interrupted; nothing half-written\n"


def test_quiet_prints_no_progress(capsys):
    assert main(["materials", "al-6061-t6", "--quiet"]) == 0
    progress()("not shown")
    assert capsys.readouterr().err == ""
    assert main(["materials", "al-6061-t6"]) == 0
    progress()("shown")
    assert "shown" in capsys.readouterr().err


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_an_error_of_a_library_that_a_signal_interrupts_is_the_signal(number):
    def load():
        try:
            signal.raise_signal(number)
        except KeyboardInterrupt:
            raise ImportError("partially initialized module") from None

    with pytest.raises(Ended) as ended:
        as_interrupts()(load)()
    assert ended.value.number == number


def test_a_signal_waits_until_a_compiled_library_is_loaded():
    loaded = []

    class Loader(ExtensionFileLoader):
        def exec_module(self, module):
            signal.raise_signal(signal.SIGTERM)
            loaded.append(True)

    def load():
        Loader("compiled", "compiled.so").exec_module(None)
        time.sleep(10)

    with pytest.raises(Ended):
        as_interrupts()(load)()
    assert loaded


def test_a_library_that_is_not_there_is_named_with_the_extra_that_brings_it(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    for name in [m for m in sys.modules if m.startswith(("dftfs.cad.", "dftfs.cli.export"))]:
        monkeypatch.delitem(sys.modules, name)
    assert main(["export", "ref"]) == 2
    line = "dftfs export: ezdxf is not installed: pip install 'dftfs[cad]'\n"
    assert capsys.readouterr().err == line


def test_a_time_budget_ends_a_command_as_ctrl_c_does(monkeypatch, capsys):
    slow = importlib.import_module("dftfs.cli.materials")
    monkeypatch.setattr(slow, "run", lambda arguments: time.sleep(20))
    begun = time.monotonic()
    assert main(["materials", "--time", "0.05"]) == 128 + signal.SIGALRM
    assert time.monotonic() - begun < 10
    error = capsys.readouterr().err
    assert error == "dftfs materials: the time of --time is over; nothing half-written\n"


def test_a_budget_of_gigabytes_is_one_line_and_over_afterwards(monkeypatch, capsys):
    large = importlib.import_module("dftfs.cli.materials")
    monkeypatch.setattr(large, "run", lambda arguments: len(bytearray(3_000_000_000)))
    assert main(["materials", "--memory", "2.5"]) == 3
    assert capsys.readouterr().err == "dftfs materials: out of memory\n"
    assert len(bytearray(2_600_000_000)) > 0


@pytest.mark.parametrize("words", [["--time", "0"], ["--time", "nan"], ["--memory", "-1"]])
def test_an_impossible_budget_is_one_line(words, capsys):
    assert main(["materials", *words]) == 2
    assert capsys.readouterr().err.count("\n") == 1


REFUSED_WHEN_RUN = """
name = "rigid"
[rig]
name = "train"
parts = ["drive", "gear", "load"]
supply_voltage_V = 12.0
terminal_resistance_ohm = 2.5
torque_constant_Nm_per_A = 0.02
back_emf_constant_Vs_per_rad = 0.02
motor_inertia_kgm2 = 1.6e-6
gear_ratio = 50.0
load_inertia_kgm2 = 0.003
[load]
kind = "locked"
[reference]
kind = "sine"
amplitude_Nm = 0.1
frequency_Hz = 1.0
[controller]
kind = "pid-torque"
kp = 1.0
ki = 1.0
kd = 0.0
[simulation]
duration_s = 1.0
"""


@pytest.mark.parametrize("existed", [False, True])
def test_a_command_that_fails_removes_the_empty_folder_that_it_made(tmp_path, capsys, existed):
    scenario, folder = tmp_path / "s.toml", tmp_path / "files"
    scenario.write_text(REFUSED_WHEN_RUN, encoding="utf-8")
    if existed:
        folder.mkdir()
    assert main(["simulate", str(scenario), "--out", str(folder)]) == 2
    assert "no spring between wheel and load" in capsys.readouterr().err
    assert folder.exists() == existed
