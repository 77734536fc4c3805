"""Write docs/effects.md from the registry of effects: `python docs/effects.py`.

The page holds what each effect's own file says of it: physics, equation, parameters with their
bounds and sources, the figures that a diagnosis reports, the variants that it tries.
`tests/docs/test_effects_document.py` checks that the page is as fresh as the registry.
"""

import dataclasses
import inspect
import re
from pathlib import Path

from rsea_core.effects.base import Term
from rsea_core.effects.known_variants import laws_by_key
from rsea_core.effects.registry import LAWS

PAGE = Path(__file__).with_name("effects.md")
HEAD = """# Effects

Every physical effect that a simulation can have and a diagnosis can find, made by
`python docs/effects.py` from the files of `rsea_core/effects/`, one an effect. Names of effects
are those of the file contract (`docs/recordings.md`). How to add one: `docs/adding-an-effect.md`.
How large an effect must be to show depends on the recordings: `diagnosis.json` says it of each.
"""


def text() -> str:
    """The whole page."""
    lines = [HEAD, "| effect | acts at | model variants of a simulation |", "| --- | --- | --- |"]
    for effect, laws in sorted(LAWS.items()):
        port = next(iter(laws.values())).port
        place = f"{port.value[0]} ({port.unit})"
        lines.append(f"| [{effect}](#{effect}) | {place} | {', '.join(laws)} |")
    variants: dict[str, list[str]] = {}
    for law in laws_by_key().values():
        if law.nuisance:
            continue
        if law.law not in variants.setdefault(law.effect, []):
            variants[law.effect].append(law.law)
    for effect, laws in sorted(LAWS.items()):
        lines += ["", f"## {effect}"]
        head = next((kind.headline for kind in laws.values() if kind.headline), "")
        lines += ["", head] if head else []
        for kind in laws.values():
            lines += ["", *_section(kind)]
        tried = variants.get(effect, [])
        if len(tried) > 8:
            tried = [*tried[:3], "...", tried[-1]]
        lines += ["", f"A diagnosis tries: {'; '.join(tried)}." if tried else
                  "A diagnosis does not look for it by itself."]  # fmt: skip
    return "\n".join(lines) + "\n"


def _section(kind: type[Term]) -> list[str]:
    doc = inspect.cleandoc(kind.__doc__ or "")
    physics = re.split(r"\n\n(?:Attributes|Raises|Source)\n", doc)[0]
    source = doc.partition("Source\n------\n")[2].split("\n\n")[0]
    found = [f"### {kind.effect}, {kind.law}", "", physics]
    if source:
        found += ["", "Source: " + " ".join(source.split())]
    rows = [
        f"| `{f.name}` | {f.metadata['unit']} | {_bounds(f.metadata['bounds'])} |"
        f" {'' if f.default is dataclasses.MISSING else f'{f.default:g}'} |"
        f" {f.metadata['meaning']} | {f.metadata['source']} |"
        for f in dataclasses.fields(kind)
        if "bounds" in f.metadata
    ]
    if rows:
        head = ["| parameter | unit | bounds | default | meaning | source |",
                "| --- | --- | --- | --- | --- | --- |"]  # fmt: skip
        found += ["", *head, *rows]
    if kind.figure_units:
        names = ", ".join(
            f"`{name}`" + (f" ({unit})" if unit not in ("", "-", "/s") else "")
            for name, unit in kind.figure_units.items()
        )
        found += ["", f"Reported: {names}."]
    if kind.curve is not None:
        curve = kind.curve
        found += ["", f"Drawn: {curve.y_label} over {curve.x_label}."]
    return [line.rstrip() for line in "\n".join(found).splitlines()]


def _bounds(bounds: tuple[float, float]) -> str:
    return f"{bounds[0]:g} to {bounds[1]:g}"


if __name__ == "__main__":
    PAGE.write_text(text(), encoding="utf-8")
    print(PAGE)
