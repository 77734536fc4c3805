"""The same case told in another way: the diagnosis has to be the same.

    python -m benchmarks.metamorphic CASE [CASE ...] [--out DIR] [--only NAME ...]

Each case folder is diagnosed as it is and in these forms: every second row left out; its longest
identification recording split in two; recordings and columns in another order; every angle,
torque, current and command with the other sign (gravity and spring are odd in them); and, for a
machine without gravity, written in other units of inertia, torque and command (one scale for
all forces). Verdict and claimed effects (confidence 0.5 and above) have to agree.
"""

import argparse
import json
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np

SIGNED = re.compile(r"angle_rad|deflection|torque_Nm|current|velocity|duty|voltage_V")
FORCES = re.compile(r"^(load_mass|\w*inertia|\w*viscous|spring_stiffness|torque_constant|torque_s)")
SCALE = 8.0  # a power of two: no rounding


def read(path: Path) -> tuple[list[str], np.ndarray]:
    names = path.read_text(encoding="utf-8").split("\n", 1)[0].split(",")
    return names, np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)


def write(path: Path, names: list[str], rows: np.ndarray) -> None:
    np.savetxt(path, rows, delimiter=",", fmt="%.12g", header=",".join(names), comments="")


def tables(folder: Path) -> list[str]:
    """rig.toml's text before the first recording, then each recording's."""
    return re.split(r"(?=\[\[recording\]\])", (folder / "rig.toml").read_text(encoding="utf-8"))


def halved(folder: Path) -> None:
    """Every second row. A held command keeps the value at the rows that stay."""
    for path in folder.glob("rec*.csv"):
        names, rows = read(path)
        write(path, names, rows[::2])


def split(folder: Path) -> None:
    """The longest recording as two; the second starts in motion."""
    head, *listed = tables(folder)
    used = [t for t in listed if "validation" not in t]
    files = [tomllib.loads(t)["recording"][0]["file"] for t in used]
    longest = max(files, key=lambda f: read(folder / f)[1].shape[0])
    names, rows = read(folder / longest)
    middle = rows.shape[0] // 2
    second = rows[middle:].copy()
    second[:, 0] -= second[0, 0]
    write(folder / longest, names, rows[:middle])
    write(folder / f"second-{longest}", names, second)
    k = next(i for i, t in enumerate(listed) if f'"{longest}"' in t)
    more = listed[k].replace(longest, f"second-{longest}").replace("initial_rest = false\n", "")
    listed.insert(k + 1, f"\n{more.rstrip()}\ninitial_rest = false\n\n")
    (folder / "rig.toml").write_text("".join([head, *listed]), encoding="utf-8")


def reordered(folder: Path) -> None:
    """Recordings and columns last to first."""
    head, *listed = tables(folder)
    text = "\n\n".join([head.rstrip(), *(t.rstrip() for t in reversed(listed)), ""])
    (folder / "rig.toml").write_text(text, encoding="utf-8")
    for path in folder.glob("rec*.csv"):
        names, rows = read(path)
        write(path, names[::-1], rows[:, ::-1])


def mirrored(folder: Path) -> None:
    """Every signed reading and command with the other sign."""
    for path in folder.glob("rec*.csv"):
        names, rows = read(path)
        rows[:, [bool(SIGNED.search(n)) for n in names]] *= -1.0
        write(path, names, rows)


class FormError(Exception):
    """This form does not exist of this case."""


def rescaled(folder: Path) -> None:
    """Forces in a unit 8 times smaller, the drive's torque constant with them.

    Only a drive by current or none: with a winding, the back-emf would tie volts to forces.
    """
    head, *listed = tables(folder)
    rig = tomllib.loads(head)["rig"]
    if "terminal_resistance_ohm" in rig:
        raise FormError("a winding ties volts to forces")
    part, more = re.split(r"(?=\n\[tolerances\])|$", head, maxsplit=1)[0], ""
    more = head[len(part) :]
    lines = [
        f"{k.strip()} = {float(v) * SCALE!r}" if FORCES.match(k.strip()) else line
        for line in part.split("\n")
        for k, _, v in [line.partition("=")]
    ]
    (folder / "rig.toml").write_text("".join(["\n".join(lines), more, *listed]), encoding="utf-8")
    for path in folder.glob("rec*.csv"):
        names, rows = read(path)
        rows[:, [n.endswith("torque_Nm") for n in names]] *= SCALE
        write(path, names, rows)


FORMS: dict[str, Callable[[Path], None]] = {
    "as it is": lambda folder: None,
    "every second row": halved,
    "one recording split": split,
    "other order": reordered,
    "other signs": mirrored,
    "other units": rescaled,
}


def verdict(case: Path, out: Path) -> tuple[str, tuple[str, ...]]:
    """Verdict and claims of `dftfs diagnose`, or its one line."""
    command = [sys.executable, "-m", "dftfs", "diagnose", str(case), "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        return (done.stderr.strip().splitlines() or ["no message"])[-1], ()
    found = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
    claims = [e["name"] for e in found["effects"] if e["confidence"] >= 0.5]
    return found["verdict"], tuple(sorted(claims))


def main() -> int:
    """Diagnose every form of every case; 1 if one differs from the case as it is."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="+", type=Path)
    parser.add_argument("--out", type=Path, default=Path("out/metamorphic"))
    parser.add_argument("--only", nargs="+", choices=list(FORMS), default=list(FORMS))
    given = parser.parse_args()
    differ = 0
    for case in given.cases:
        first = None
        for form in dict.fromkeys(["as it is", *given.only]):
            place = given.out / case.name / form.replace(" ", "-")
            shutil.rmtree(place, ignore_errors=True)
            shutil.copytree(case, place / "case")
            try:
                FORMS[form](place / "case")
            except FormError as reason:
                print(f"{case.name}, {form}: not possible: {reason}")
                continue
            found = verdict(place / "case", place / "out")
            first = first or found
            same = found == first
            differ += not same
            claims = ", ".join(found[1]) or "-"
            print(f"{case.name}, {form}: {'same' if same else 'DIFFERS'}: {found[0]}: {claims}",
                  flush=True)  # fmt: skip
    return int(differ > 0)


if __name__ == "__main__":
    sys.exit(main())
