"""Mutated inputs against every reader: each is read or refused in one line, never a traceback.

    python -m benchmarks.fuzz --inputs 100000 [--readers design,rig] [--seed 1]

A defect is any other exception, a message that is no line, a numerical warning, more than 20 s or
6 GB.
The first input of each defect is kept under out/fuzz/. Reader, seed and number reproduce an input.
"""

import argparse
import copy
import math
import random
import resource
import signal
import string
import tempfile
import tomllib
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Mapping
from importlib import resources
from pathlib import Path

from dftfs.analysis.sizing.task import load_task
from dftfs.analysis.sweep.points import grid_points, list_points, parse_vary
from dftfs.cli.endings import one_line
from dftfs.design import design_toml, load_design
from dftfs.errors import DftfsError
from dftfs.material import load_materials
from dftfs.process import find_process
from rsea_core.errors import RseaError
from rsea_core.files.toml_tables import toml_string
from rsea_core.machine.rig import Rig
from rsea_core.model.model_file import read_model
from rsea_core.model.spring_curve_file import SignWarning, read_spring_curve
from rsea_core.recordings.case import read_case, read_test
from rsea_core.scenarios.comparison_file import read_comparison
from rsea_core.scenarios.scenario import Scenario

SECONDS = 20
MOST_BYTES = 6_000_000_000
NUMBERS = (
    0, 1, -1, 2, 7, 1000, 0.0, 0.5, -0.5, 1e-9, 1e-300, 5e-324, 1e9, 1e30, 1e300, -1e200, math.nan,
    math.inf, -math.inf, 2**31, 2**63 - 1, 2**64, 10**400, -(10**400), 8192, 0.1,
)  # fmt: skip
TOKENS = (
    "", " ", "x", "al1", "<script>", "../../x", "..", "/", "a\0b", "a\nb", "-x", "é\u202e", "nan",
    "1e400", "1,5", "'", '"', "\\", "%s%n", "{0}", "x" * 300, "A" * 5000, "pendulum", "contact",
    "sine", "csv", "rec1.csv", "r.toml", "/dev/zero", "true", "4:13:10", "1:2:0", "a=b",
)  # fmt: skip
TEXTS = (
    b"", b"\n", b"x = " + b"[" * 3000, b"a." * 3000 + b"b = 1", b"x = " + b"9" * 5000, b"\xff\xfe",
    b"\0" * 100, b"[a]\n" * 2, b"x = 1979-13-45", b"{" * 2000, b'"' * 1000, b"," * 5000,
)  # fmt: skip
COLUMNS = ("time_s", "duty", "motor_angle_rad", "load_angle_rad", "current_A", "torque_Nm")
CASE = """
[[recording]]
file = "rec1.csv"
load = "locked"
description = "slow"
[[recording]]
file = "rec2.csv"
role = "validation"
load = "contact"
contact_stiffness_Nm_per_rad = 100.0
contact_angle_rad = 0.1
"""
TERMS = """
[[term]]
effect = "gear-friction"
coulomb_Nm = 0.02
[[term]]
effect = "spring-curve"
deflection_rad = [-0.2, 0.0, 0.2]
torque_Nm = [-12.0, 0.0, 12.0]
"""
OWN_MATERIAL = """
[materials.mine]
description = "own batch"
family = "aluminium"
youngs_modulus_GPa = 71.0
poisson_ratio = 0.33
density_kg_per_m3 = 2700.0
yield_strength_MPa = 300.0
ultimate_strength_MPa = 350.0
creeps = false
[materials.mine.source]
youngs_modulus_GPa = "tensile test"
poisson_ratio = "table"
density_kg_per_m3 = "weighed"
yield_strength_MPa = "tensile test"
ultimate_strength_MPa = "tensile test"
"""
TEST = '[[recording]]\nfile = "t1.csv"\nload = "locked"\ninitial_motor_angle_rad = 0.0\n'


def _data(package: str, *places: str) -> list[str]:
    root = resources.files(package)
    return [root.joinpath(place).read_text(encoding="utf-8") for place in places]


def _table(rows: int = 40) -> str:
    lines = [",".join(COLUMNS)]
    for k in range(rows):
        s = math.sin(0.3 * k)
        lines.append(f"{k * 1e-3:.4f},{0.1 * s:.5f},{s:.6f},{0.01 * s:.6f},{0.2 * s:.4f},{s:.4f}")
    return "\n".join(lines) + "\n"


def _log(rows: int = 40) -> str:
    lines = ["Time,Motor Angle,Error Angle,PWM out"]
    lines += [f"{k},{math.sin(k) * 90:.3f},{math.cos(k):.3f},{50 + k % 9}" for k in range(rows)]
    return "\n".join(lines) + "\n"


def _curve() -> str:
    rows = "".join(f"{0.02 * k:.3f},{1.3 * k:.3f}\n" for k in range(-10, 11))
    return "deflection_rad,torque_Nm\n" + rows


def reader_seeds() -> dict[str, list[str]]:
    """Inputs that each reader takes, to be changed."""
    rig = _data("rsea_core", "data/rsea-bench.toml")
    scenario = _data("dftfs", "examples/torque-1hz.toml")
    return {
        "design": _data("dftfs", "data/designs/al1.toml", "data/designs/ti.toml"),
        "materials": [OWN_MATERIAL],
        "process": _data("dftfs", "data/processes.toml"),
        "task": _data("dftfs", "data/sizing/default.toml", "data/sizing/table-2.5.toml"),
        "scenario": [scenario[0], scenario[0].replace('design = "al1"', 'curve_csv = "c.csv"')],
        "comparison": _data(
            "dftfs",
            "examples/compare-torque-worm.toml",
            "examples/compare-impedance-disturbed.toml",
        ),
        "rig": rig,
        "case": [rig[0] + CASE],
        "model": [rig[0] + TERMS],
        "test": [TEST],
        "recording": [_table(), _log()],
        "curve": [_curve()],
        "list": ["width_mm,turns,material\n4.0,1.9,al-thesis\n5.0,1.8,al-thesis\n"],
        "vary": ["width_mm=4:13:10", "turns=1.7,1.8", "material=al-thesis"],
        "set": ["width_mm=7", "rim_thickness_mm=7", "turns=2", "n_arms=3", "start_angle_deg=5"],
    }


def _design(path: Path) -> None:
    design = load_design(str(path))
    again = path.with_name("again.toml")
    again.write_text(design_toml(design), encoding="utf-8")
    if b"materials_file" not in path.read_bytes():
        assert abs(load_design(str(again)).mass_kg / design.mass_kg - 1) < 1e-6


def _recording(path: Path) -> None:
    rig = _data("rsea_core", "data/rsea-bench.toml")[0]
    case = '[[recording]]\nfile = "input"\nload = "locked"\n'
    (path.parent / "rig.toml").write_text(rig + case, encoding="utf-8")
    read_case(path.parent)


def _case(path: Path) -> None:
    (path.parent / "rig.toml").write_bytes(path.read_bytes())
    read_case(path.parent)


def _test(path: Path) -> None:
    (path.parent / "test.toml").write_bytes(path.read_bytes())
    read_test(path.parent, Rig.preset("rsea-bench"))


def _set(path: Path) -> None:
    field, _, value = path.read_bytes().decode("utf-8", "replace").partition("=")
    load_design("al1", {field: value})


READERS: Mapping[str, Callable[[Path], object]] = {
    "design": _design,
    "materials": load_materials,
    "process": lambda path: find_process("wire-edm", path),
    "task": lambda path: load_task(str(path), {}),
    "scenario": Scenario.from_toml,
    "comparison": read_comparison,
    "rig": Rig.from_toml,
    "case": _case,
    "model": read_model,
    "test": _test,
    "recording": _recording,
    "curve": read_spring_curve,
    "list": list_points,
    "vary": lambda path: grid_points([parse_vary(path.read_bytes().decode("utf-8", "replace"))]),
    "set": _set,
}
TABLES = {"recording", "curve", "list"}
PLAIN = {"vary", "set"}


def _value(rng: random.Random, depth: int = 0) -> object:
    kind = rng.random()
    if kind < 0.5:
        return rng.choice(NUMBERS)
    if kind < 0.75:
        return rng.choice(TOKENS)
    if kind < 0.82 or depth > 2:
        return rng.choice([True, False])
    if kind < 0.92:
        return [_value(rng, depth + 1) for _ in range(rng.randrange(4))]
    return {rng.choice(TOKENS[:12]): _value(rng, depth + 1) for _ in range(rng.randrange(3))}


def _places(value: object) -> list[tuple[object, object]]:
    """Every (container, key) inside a document."""
    items = value.items() if isinstance(value, dict) else enumerate(value[:20])
    found = []
    for key, inner in list(items):
        found.append((value, key))
        found += _places(inner) if isinstance(inner, dict | list) else []
    return found


def _changed_document(rng: random.Random, document: dict) -> str:
    document = copy.deepcopy(document)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        places = _places(document)
        if not places:
            break
        container, key = rng.choice(places)
        old, kind = container[key], rng.random()
        if kind < 0.15:
            del container[key]
        elif kind < 0.3 and isinstance(container, dict):
            container[rng.choice((f"{key}x", str(key)[:-1], *TOKENS[:6]))] = container.pop(key)
        elif kind < 0.6 and isinstance(old, int | float):
            factors = (0, -1, 10) if abs(old) > 1e9 else (0, -1, 10, 0.1, 1e3, 1e-3, 1e12, 1.01)
            container[key] = old * rng.choice(factors)
        elif kind < 0.7 and isinstance(old, list):
            container[key] = old * 3
        else:
            container[key] = _value(rng)
    return "".join(f"{_quoted(k)} = {_toml(v)}\n" for k, v in document.items())


def _quoted(key: object) -> str:
    return toml_string(str(key))


def _toml(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return toml_string(value)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_quoted(k)} = {_toml(v)}" for k, v in value.items()) + "}"
    return f"[{', '.join(map(_toml, value))}]" if isinstance(value, list) else str(value)


def _changed_table(rng: random.Random, text: str) -> str:
    rows = [line.split(",") for line in text.splitlines()]
    for _ in range(rng.choice((1, 1, 2, 5))):
        k = rng.randrange(len(rows))
        kind = rng.random()
        if kind < 0.5 and rows[k]:
            rows[k][rng.randrange(len(rows[k]))] = str(rng.choice((*NUMBERS, *TOKENS)))
        elif kind < 0.6 and len(rows) > 1:
            del rows[k]
        elif kind < 0.7:
            rows.insert(k, list(rows[k]))
        elif kind < 0.8:
            rows = rows[: rng.choice((1, 2, 3))]
        elif kind < 0.9:
            rows[k] = rows[k][:-1] or ["1"]
        else:
            rows = [[row[0], *row[2:]] if len(row) > 2 else row for row in rows]
    return "\n".join(map(",".join, rows)) + "\n"


def _changed_bytes(rng: random.Random, content: bytes) -> bytes:
    content = bytearray(content or b"x")
    for _ in range(rng.choice((1, 2, 8))):
        k, kind = rng.randrange(len(content)), rng.random()
        if kind < 0.4:
            content[k] = rng.choice((0, 10, 34, 44, 46, 91, 255, rng.randrange(256)))
        elif kind < 0.7:
            content[k:k] = rng.choice(string.printable).encode() * rng.choice((1, 3, 60))
        else:
            content = content[:k] + content[k + rng.choice((1, 10, 100)) :] or bytearray(b"x")
    return bytes(content)


def changed_input(rng: random.Random, reader: str, seeds: list[str]) -> bytes:
    """One input that is near one of a reader's own."""
    seed, kind = rng.choice(seeds), rng.random()
    if kind < 0.02:
        return rng.choice(TEXTS)
    if kind < 0.25 or (reader in PLAIN and kind < 0.6):
        return _changed_bytes(rng, seed.encode())
    if reader in PLAIN:
        return f"{seed.partition('=')[0]}={rng.choice((*NUMBERS, *TOKENS))}".encode()
    if reader in TABLES:
        return _changed_table(rng, seed).encode("utf-8", "surrogatepass")
    return _changed_document(rng, tomllib.loads(seed)).encode("utf-8", "surrogatepass")


def attack(reader: str, inputs: int, seed: int, folder: Path) -> tuple[Counter, dict[str, bytes]]:
    """How many inputs were read and refused, and the first input of each defect.

    Parameters
    ----------
    folder : Path
        Made; the files of the attack are written into it.
    """
    seeds, counts, defects = reader_seeds()[reader], Counter(), {}
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in (("rec1.csv", _table()), ("rec2.csv", _table()), ("c.csv", _curve())):
        (folder / name).write_text(text)
    (folder / "t1.csv").write_text("time_s,duty\n0.0,0.1\n0.001,0.1\n0.002,0.1\n")
    path = folder / "input"
    for k in range(inputs):
        rng = random.Random(f"{reader} {seed} {k}")
        content = changed_input(rng, reader, seeds)
        path.write_bytes(content)
        defect = _defect(READERS[reader], path, counts)
        if defect is not None:
            defects.setdefault(defect, content)
            counts["defects"] += 1
    return counts, defects


def _defect(read: Callable[[Path], object], path: Path, counts: Counter) -> str | None:
    before = signal.signal(signal.SIGALRM, _too_long)
    signal.alarm(SECONDS)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", SignWarning)  # one line to the user
            read(path)
        counts["read"] += 1
    except (DftfsError, RseaError) as error:
        counts["refused"] += 1
        if not one_line(str(error)).isprintable():
            return f"message that is no line: {str(error)[:80]!r}"
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__} at {Path(last.filename).name}:{last.lineno}: {error!s:.80}"
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
    return None


def _too_long(number: int, frame: object) -> None:
    raise TimeoutError(f"more than {SECONDS} s")


def main() -> int:
    """Attack the readers in turn; exit status 1 if there is a defect."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--inputs", type=int, default=100_000, help="in all (default 100,000)")
    parser.add_argument("--readers", default=",".join(READERS))
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))  # a defect, not a dead machine
    names, total = asked.readers.split(","), Counter()
    kept = Path("out") / "fuzz"
    with tempfile.TemporaryDirectory() as room:
        for name in names:
            each = math.ceil(asked.inputs / len(names))
            counts, defects = attack(name, each, asked.seed, Path(room) / name)
            total += counts
            print(f"{name}: {each} tried, {counts['read']} read, {counts['refused']} refused,"
                  f" defects: {counts['defects']}", flush=True)  # fmt: skip
            for j, (defect, content) in enumerate(defects.items()):
                kept.mkdir(parents=True, exist_ok=True)
                (kept / f"{name}-{j}").write_bytes(content)
                print(f"  {defect} ({kept / f'{name}-{j}'})", flush=True)
    print(f"all: {total['read'] + total['refused'] + total['defects']} tried,"
          f" defects: {total['defects']}")  # fmt: skip
    return 1 if total["defects"] else 0


if __name__ == "__main__":
    raise SystemExit(main())
