"""Published motors, gears and springs, to start a rig from: every part with its source.

Read from ``data/parts.toml``; fields and units are those of a rig file.
"""

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources

from dftfs.errors import DesignError
from rsea_core.files.toml_tables import number, parse_toml, word

KINDS = ("motor", "gear", "spring")


@dataclass(frozen=True, kw_only=True)
class Part:
    """A motor, gear or spring; ``values`` holds (field of a rig, number in SI units)."""

    name: str
    kind: str
    description: str
    source: str
    values: tuple[tuple[str, float], ...]


@cache
def parts() -> tuple[Part, ...]:
    """Every part of the library, motors first."""
    text = resources.files("dftfs").joinpath("data", "parts.toml").read_text(encoding="utf-8")
    tables, found = parse_toml(text, "parts.toml", DesignError), []
    for kind in KINDS:
        for name, table in tables[kind].items():
            where = f"parts.toml: {name}"
            texts = [word(table.pop(key), f"{where}: {key}", DesignError)
                    for key in ("description", "source")]  # fmt: skip
            values = tuple((k, number(v, f"{where}: {k}", DesignError)) for k, v in table.items())
            found.append(
                Part(name=name, kind=kind, description=texts[0], source=texts[1], values=values)
            )
    return tuple(found)


def find(names: Iterable[str]) -> tuple[Part, ...]:
    """The parts of these names or kinds, all where there are none.

    Parameters
    ----------
    names : iterable of str
        Names as in the library, or one of `KINDS`; `motor.NAME` where two parts share a name.

    Raises
    ------
    DesignError
        If there is no such part; the message names the nearest.
    """
    names = list(names)
    found = []
    for asked in names:
        own = [p for p in parts() if asked in (p.name, p.kind, f"{p.kind}.{p.name}")]
        if not own:
            known = [*KINDS, *(p.name for p in parts())]
            near = difflib.get_close_matches(asked[:100], known, n=1, cutoff=0.5)
            hint = f"did you mean {near[0]}?" if near else "`dftfs parts list` has them all"
            raise DesignError(f"no part {asked!r}; {hint}")
        found += own
    return tuple(dict.fromkeys(found)) if names else parts()


def rig_values(chosen: Iterable[Part]) -> Mapping[str, float | None]:
    """Fields of a rig that the parts state; None: a field of that kind which they do not state.

    Raises
    ------
    DesignError
        If two parts are of one kind.
    """
    chosen, found = list(chosen), {}
    for kind in KINDS:
        own = [p for p in chosen if p.kind == kind]
        if len(own) > 1:
            raise DesignError(f"{' and '.join(p.name for p in own)}: a rig has one {kind}")
        for part in own:
            known = dict.fromkeys(k for p in parts() if p.kind == kind for k, _ in p.values)
            known.pop("motor_inertia_kgm2" if kind == "gear" else "", None)
            found |= known | {k: v for k, v in part.values if k in known}
            if kind == "gear" and found.get("motor_inertia_kgm2"):
                found["motor_inertia_kgm2"] += dict(part.values).get("motor_inertia_kgm2", 0.0)
    return found
