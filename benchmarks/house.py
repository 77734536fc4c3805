"""Sizes of the program, by command: `python -m benchmarks.house`.

Lines of each package, modules per folder, the longest module, class and function, exceptions from
the limits, names at the top of `rsea_core`, seconds of import beyond numpy's.
"""

import subprocess
import sys
from collections import Counter
from pathlib import Path

import rsea_core
from tests.cases.sources import exceptions, measured

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("rsea_core", "dftfs", "tests", "benchmarks")


def import_seconds(module: str) -> float:
    """Seconds to import a module where numpy is loaded; the quickest of five."""
    code = f"import time, numpy; t = time.perf_counter(); import {module};"
    code += " print(time.perf_counter() - t)"
    run = [sys.executable, "-c", code]
    return min(float(subprocess.check_output(run, cwd=ROOT, text=True)) for _ in range(5))


def main() -> None:
    for package in PACKAGES:
        files = sorted((ROOT / package).rglob("*.py"))
        lines = sum(len(f.read_text(encoding="utf-8").splitlines()) for f in files)
        print(f"{package}: {lines} lines in {len(files)} modules")
    folders = Counter(p.parent for top in PACKAGES[:2] for p in (ROOT / top).rglob("*.py"))
    for folder, count in folders.most_common(3):
        print(f"modules in {folder.relative_to(ROOT)}: {count}")
    for rule, sizes in measured()[0].items():
        name = max(sizes, key=sizes.get)
        print(f"largest of {rule}: {sizes[name]} in {name}")
    for rule, entries in exceptions().items():
        print(f"exceptions, {rule}: {len(entries)}")
    print(f"names at the top of rsea_core: {len(rsea_core.__all__)}")
    for module in ("rsea_core", "dftfs.cli.main"):
        print(f"import {module} after numpy: {1e3 * import_seconds(module):.0f} ms")


if __name__ == "__main__":
    main()
