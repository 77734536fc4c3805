"""What of this machine `dftfs` can use, what is missing and what makes it slow: `dftfs doctor`."""

import importlib.util
import os
import platform
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import rsea_core
from dftfs.cad.system_libraries import missing_libraries_message, missing_system_libraries
from dftfs.cli.extras import EXTRA_OF, installed, requirements
from dftfs.errors import DftfsError
from dftfs.report.pdf import browser

GOOD, SLOW, MISSING = "good", "slow", "missing"
FOR = {
    "fe": "study, verify, sweep, size",
    "cad": "export, deliver, parts, study",
    "render": "pictures of stress",
    "logs": "logs that are not CSV",
    "interop": "NetCDF, Parquet, python-control, gymnasium, FMU",
    "cluster": "--cluster",
    "peers": "MuJoCo",
}
THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


@dataclass(frozen=True, kw_only=True)
class Check:
    """One thing that was looked at: its state is `GOOD`, `SLOW` or `MISSING`."""

    name: str
    state: str
    found: str


def checks(cache: Path) -> list[Check]:
    """Everything that a command may need of this machine.

    Parameters
    ----------
    cache : Path
        Folder of kept solves.
    """
    python = f"{platform.python_version()} on {platform.system()} {platform.machine()}"
    found = [Check(name="Python", state=GOOD, found=python), _processors(), _libraries()]
    return [*found, *_extras(), _solver(), _compiled(), _kept(cache), *_programs()]


def _processors() -> Check:
    limits = {name: os.environ[name] for name in THREADS if os.environ.get(name)}
    count = os.cpu_count() or 1
    free = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else count
    text = f"{count}" + (f", {free} of them for this program" if free < count else "")
    text += "".join(f", {name}={value}" for name, value in limits.items())
    if hasattr(os, "sysconf"):
        text += f"; memory {os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES') / 1e9:.1f} GB"
    slow = free < count or limits.get("NUMBA_NUM_THREADS", str(count)) != str(count)
    return Check(name="processors", state=SLOW if slow else GOOD, found=text)


def _libraries() -> Check:
    message = missing_libraries_message(missing_system_libraries())
    found = message or "all that CAD, meshing and rendering load"
    return Check(name="system libraries", state=MISSING if message else GOOD, found=found)


def _extras() -> Iterator[Check]:
    for extra, use in FOR.items():
        absent = [name for name, own in requirements() if own == extra and not installed(name)]
        absent = [name for name in absent if name != "pypardiso"]  # `_solver`
        line = f"{use}: {', '.join(absent)} not installed: pip install 'dftfs[{extra}]'"
        yield Check(name=extra, state=MISSING if absent else GOOD, found=line if absent else use)


def _solver() -> Check:
    if importlib.util.find_spec("pypardiso"):
        return Check(name="linear solver", state=GOOD, found="MKL PARDISO")
    line = "SuperLU: the same answers, several times slower"
    line += f"; on x86: pip install 'dftfs[{EXTRA_OF['pypardiso']}]'"
    return Check(name="linear solver", state=SLOW, found=line)


def _compiled() -> Check:
    """numba's kernels are kept beside their sources, or in the user's cache folder."""
    root = Path(rsea_core.__file__).parent
    count = sum(1 for _ in root.rglob("*.nbi"))
    if count:
        return Check(name="compiled kernels", state=GOOD, found=f"{count} kept in {root}")
    line = "none cached: the first run of each engine compiles for some minutes"
    if not os.access(root, os.W_OK):
        line += f"; {root} is not writable: set NUMBA_CACHE_DIR to a folder that is"
    return Check(name="compiled kernels", state=SLOW, found=line)


def _kept(cache: Path) -> Check:
    sizes = [path.stat().st_size for path in cache.rglob("*") if path.is_file()]
    free = shutil.disk_usage(cache).free / 1e9
    found = f"{len(sizes)} solves, {sum(sizes) / 1e6:.0f} MB in {cache}; {free:.1f} GB free"
    return Check(name="kept solves", state=GOOD, found=found)


def _programs() -> Iterator[Check]:
    compiler = shutil.which("cc") or shutil.which("gcc")
    line = compiler or "none: deploy and fmu cannot test the C that they write: apt-get install gcc"
    yield Check(name="C compiler", state=GOOD if compiler else MISSING, found=line)
    try:
        yield Check(name="browser for --pdf", state=GOOD, found=browser())
    except DftfsError as error:
        yield Check(name="browser for --pdf", state=MISSING, found=str(error))
