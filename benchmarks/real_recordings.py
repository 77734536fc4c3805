"""Diagnose real recordings with motion, compare with published figures, write the page.

    python benchmarks/real_recordings.py FOLDER [--out docs] [--keep DIR] [--only NAME ...]

FOLDER holds one case for each set (emps, bam-xl330, worm-drive, leylaz-flexlink); a set that is
not there is left out. Every diagnosis is `dftfs diagnose` as a user types it; it sees validation
recordings only to report. Nothing of the recordings but figures and pictures is written.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.real_recordings_figures import SETS, Section, section

COMMAND = "python -m benchmarks.real_recordings FOLDER"
PAGE = "real-recordings.md"


def diagnose(case: Path, out: Path) -> tuple[float, float]:
    """Wall and processor seconds of `dftfs diagnose`."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    given_arguments = [sys.executable, "-m", "dftfs", "diagnose", str(case)]
    subprocess.run(
        [*given_arguments, "--out", str(out), "--force"], check=True, stdout=subprocess.DEVNULL
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - began, used


def text(name: str, found: Section, document: dict, seconds: tuple[float, float]) -> list[str]:
    """The page's part of one set."""
    lines = [
        f"## {SETS[name][0]}",
        "",
        f"Verdict: **{document['verdict']}**. {document['summary']}",
    ]
    lines += ["", "| effect | law | confidence | values |", "| --- | --- | --- | --- |"]
    for e in document["effects"]:
        values = "; ".join(
            f"{k} {v['value']:.4g}" + (f" +- {v['std']:.2g}" if v["std"] is not None else "")
            for k, v in e["parameters"].items()
        )
        lines.append(f"| {e['name']} | {e['law']} | {e['confidence']:.2f} | {values} |")
    lines += ["", "| figure | dftfs | published, or to reach |", "| --- | --- | --- |"]
    lines += [f"| {row.what} | {row.ours} | {row.published} |" for row in found.rows]
    lines += ["", f"Processor time {seconds[1]:.0f} s."]
    lines += [f"\n{note[:1].upper()}{note[1:].rstrip('.')}." for note in found.notes]
    return [*lines, "", f"![{name}]({found.picture.name})", ""]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path, default=Path("docs"))
    parser.add_argument("--keep", type=Path, help="folder for the diagnoses")
    parser.add_argument("--only", nargs="*", default=list(SETS))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    keep = arguments.keep or Path(tempfile.mkdtemp())
    lines = [
        "# Real recordings with motion", "",
        f"Written by `{COMMAND}`; the recordings are their authors' and not part of this"
        " repository. Each diagnosis is `dftfs diagnose CASE` without any setting for the set;"
        " what is held out takes no part in any choice or fit.", "",
    ]  # fmt: skip
    notes = Path(__file__).with_name("real_recordings_notes.md")
    for name in SETS:
        case = arguments.folder / name
        if name not in arguments.only or not (case / "rig.toml").exists():
            continue
        out = keep / name
        seconds = diagnose(case, out)
        document = json.loads((out / "diagnosis.json").read_text())
        found = section(name, case, out, arguments.out)
        part = text(name, found, document, seconds)
        print("\n".join(part), flush=True)
        lines += part
    if notes.exists():
        lines += [notes.read_text().rstrip(), ""]
    page = arguments.out / PAGE
    unfinished = page.with_name(f".{PAGE}.{os.getpid()}")
    unfinished.write_text("\n".join(lines))
    unfinished.replace(page)
    print(page)


if __name__ == "__main__":
    main()
