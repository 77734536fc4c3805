"""Markers `slow` and `long` (listed), `fast` (all others), `needs_cad`; how examples are drawn."""

import importlib.util
import signal
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from dftfs.cad.system_libraries import missing_libraries_message, missing_system_libraries
from tests.cases.places import ROOT

pytest_plugins = ("tests.worker_watch",)

# the same examples in every run, and no verdict on the speed of a machine that is busy
settings.register_profile(
    "repeatable", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("repeatable")


@pytest.fixture(autouse=True)
def default_output_is_temporary(tmp_path_factory, monkeypatch):
    """Commands without --out write below a temporary folder, not into the repository."""
    monkeypatch.setenv("DFTFS_OUT", str(tmp_path_factory.getbasetemp() / "default-out"))


SLOW_TESTS = ROOT / "tests" / "slow_tests.txt"
LONG_TESTS = ROOT / "tests" / "long_tests.txt"
# a module with this line imports the kernel itself, so that it is skipped before its import
WHOLE_MODULE_NEEDS_CAD = "pytestmark = pytest.mark.needs_cad"


def slow_tests() -> list[str]:
    """Files and tests (`file::function`) that are not `fast`, from the list with their seconds."""
    return _listed(SLOW_TESTS)


def long_tests() -> list[str]:
    """Tests (`file::function[case]`) that run where they are asked for alone."""
    return _listed(LONG_TESTS)


def _rows(file: Path) -> list[list[str]]:
    """Seconds and test of each row of a list."""
    lines = file.read_text(encoding="utf-8").splitlines()
    return [line.split(maxsplit=1) for line in lines if line and not line.startswith("#")]


def _listed(file: Path) -> list[str]:
    return [test for _, test in _rows(file)]


def _seconds_of_files() -> Counter[str]:
    """CPU seconds of each file's slow tests, without long ones."""
    found: Counter[str] = Counter()
    long = set(long_tests())
    for seconds, test in _rows(SLOW_TESTS):
        if test in long:
            continue
        found[test.partition("::")[0]] += float(seconds)
    return found


def missing_cad_kernel() -> str:
    """Why the CAD kernel cannot be imported; empty where it can."""
    if importlib.util.find_spec("cadquery") is None:
        return "the CAD kernel is missing: pip install cadquery"
    return missing_libraries_message(missing_system_libraries())


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--long", action="store_true", help="run those of long_tests.txt, and only them"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Take SIGINT as at a terminal: a job that a shell starts in the background ignores it.

    So would every command that a test starts and interrupts.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _asked_for(items: list[pytest.Item], config: pytest.Config) -> list[pytest.Item]:
    """With --long the long tests, else the others; a file that is named runs whole."""
    if any(".py" in argument for argument in config.args):
        return items
    long = set(long_tests())
    return [item for item in items if (item.nodeid in long) == config.getoption("--long")]


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    asked_for = _asked_for(items, config)
    chosen = set(asked_for)
    config.hook.pytest_deselected(items=[item for item in items if item not in chosen])
    # the longest files first: at the end both processes then have short ones left
    seconds = _seconds_of_files()
    asked_for.sort(key=lambda item: -seconds[item.nodeid.partition("::")[0]])
    items[:] = asked_for
    slow = set(slow_tests())
    without_cad = missing_cad_kernel()
    for item in items:
        test = item.nodeid.partition("[")[0]
        is_slow = not slow.isdisjoint((test, test.partition("::")[0]))
        item.add_marker(pytest.mark.slow if is_slow else pytest.mark.fast)
        if without_cad and item.get_closest_marker("needs_cad"):
            item.add_marker(pytest.mark.skip(reason=without_cad))


class ModuleWithoutCad(pytest.Module):
    """A test module that cannot be imported here."""

    def collect(self):
        pytest.skip(missing_cad_kernel(), allow_module_level=True)


def pytest_pycollect_makemodule(module_path, parent):
    needs_cad = WHOLE_MODULE_NEEDS_CAD in module_path.read_text(encoding="utf-8")
    if needs_cad and missing_cad_kernel():
        return ModuleWithoutCad.from_parent(parent, path=module_path)
    return None
