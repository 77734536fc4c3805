"""Diagnose a set of concealed cases over many kinds of machine and score it.

    python -m benchmarks.wide_practice FOLDER [--out DIR] [--only case,case] [--jobs 2]

FOLDER holds `cases/`, `hidden/`, `labels.json`, and `score_wide.py` in itself or above (the form of
`practice-wide`). Each case is diagnosed by `dftfs diagnose`'s own call without any setting for the
set, its test is predicted from the model.toml written, and the set's own script scores both.
"""

import argparse
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from rsea_core.errors import RseaError
from rsea_core.files.csv_columns import write_columns
from rsea_core.identify.diagnose import diagnose
from rsea_core.identify.result.predict import predict


def run_case(folder: Path, out: Path) -> str:
    """Diagnose one case and predict its test; a line that says what came out."""
    begun, target = time.perf_counter(), out / folder.name
    target.mkdir(parents=True, exist_ok=True)
    try:
        found = diagnose(folder)
        model = found.save(target)["model.toml"]
        if (folder / "test").is_dir():
            for prediction in predict(model, folder / "test").values():
                write_columns(target / "prediction.csv", prediction.columns)
    except RseaError as refused:
        return f"{folder.name}: {refused}"
    named = ", ".join(f"{e['name']} ({e['confidence']:.2f})" for e in found.effects)
    seconds = time.perf_counter() - begun
    return f"{folder.name}: {found.verdict}: {named or '-'}; {seconds:.1f} s"


def main() -> int:
    """Run the set and its score."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path, default=Path("out/wide-practice"))
    parser.add_argument("--only", default="")
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    cases = sorted(given.folder.glob("cases/*"))
    if not cases:
        parser.error(f"{given.folder} has no cases/CASE: give the folder of a set")
    if given.jobs < 1:
        parser.error(f"--jobs must be at least 1, not {given.jobs}")
    wanted = set(filter(None, given.only.split(",")))
    if unknown := wanted - {c.name for c in cases}:
        parser.error(f"--only: {min(unknown)} is no case of {given.folder}, as {cases[0].name} is")
    cases = [c for c in cases if c.name in wanted or not wanted]
    failed = 0
    with ProcessPoolExecutor(given.jobs) as pool:
        for c, job in [(c, pool.submit(run_case, c, given.out)) for c in cases]:
            try:
                print(job.result(), flush=True)
            except Exception as error:  # in one case: the others are run
                print(f"{c.name}: failed: {error!r}", flush=True)
                failed += 1
    scripts = (given.folder / "score_wide.py", given.folder.parent / "score_wide.py")
    script = next((s for s in scripts if s.exists()), None)
    if script is None:
        print("no score_wide.py in the folder or above it: not scored")
        return int(failed > 0)
    command = [sys.executable, script, "--set", given.folder, "--results", given.out]
    command += ["--json", given.out / "score.json", "--only", ",".join(c.name for c in cases)]
    return subprocess.run([str(c) for c in command], check=False).returncode or int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
