"""Write docs/api.md from the docstrings of what `rsea_core` shows: `python docs/api.py`.

`tests/docs/test_manual.py` checks that the page is as fresh as the docstrings.
"""

import inspect
import re
from pathlib import Path

import rsea_core

PAGE = Path(__file__).with_name("api.md")
SECTIONS = ("Parameters", "Returns", "Attributes", "Raises", "Yields", "Source", "Notes")
HEAD = """# Python API

Made by `python docs/api.py` from the docstrings. Units are SI and radians; a name ends with its
unit. `import rsea_core` needs numpy, scipy and numba only. Results of simulations and recordings
have `to_pandas()`, `to_xarray()` and `plot()`, and show themselves as a table in a notebook.
"""


def text() -> str:
    """The page."""
    lines = [HEAD, *_prose(inspect.cleandoc(rsea_core.__doc__ or ""))]
    for name in sorted(rsea_core.__all__, key=str.lower):
        thing = getattr(rsea_core, name)
        lines += ["", f"## {name}", "", "```python", _signature(name, thing), "```", ""]
        lines += [f"`{thing.__module__}`", "", *_prose(inspect.cleandoc(thing.__doc__ or ""))]
        lines += _methods(thing) if inspect.isclass(thing) else []
    return "\n".join(lines) + "\n"


def _signature(name: str, thing: object) -> str:
    """The call, a parameter a line where it is long; without annotations, which the text states."""
    try:
        call = inspect.signature(thing)
    except ValueError:
        return name
    plain = [p.replace(annotation=inspect.Parameter.empty) for p in call.parameters.values()]
    shown = str(call.replace(parameters=plain, return_annotation=call.empty))
    shown = re.sub(r"<[^<>]*object at 0x[0-9a-f]+>", "...", shown)
    if len(shown) > 80:
        parts = [str(p) for p in plain]
        stars = next((k for k, p in enumerate(plain) if p.kind is p.KEYWORD_ONLY), None)
        if stars is not None:
            parts.insert(stars, "*")
        parts = [re.sub(r"<[^<>]*object at 0x[0-9a-f]+>", "...", part) for part in parts]
        shown = "(\n" + "".join(f"    {part},\n" for part in parts) + ")"
    return name + shown


def _methods(kind: type) -> list[str]:
    """Public methods and properties that a class or a base of this package has, a line each."""
    rows = []
    for name, member in inspect.getmembers_static(kind):
        if name.startswith("_") or name in getattr(kind, "__dataclass_fields__", {}):
            continue
        found = getattr(member, "__func__", getattr(member, "fget", member))
        doc = inspect.getdoc(found) if callable(found) or isinstance(member, property) else ""
        if doc and getattr(found, "__module__", "").startswith("rsea_core"):
            first = " ".join(doc.split("\n\n")[0].split()).replace("|", "\\|")
            rows.append(f"| `{name}{'' if isinstance(member, property) else '()'}` | {first} |")
    return ["", "| member | does |", "| --- | --- |", *rows] if rows else []


def _prose(doc: str) -> list[str]:
    """A docstring as Markdown: its sections in bold, what they list as it is set."""
    lines, out, inside = doc.splitlines(), [], False
    for k, line in enumerate(lines):
        below = lines[k + 1] if k + 1 < len(lines) else ""
        if set(below) == {"-"} and line.strip():
            out += ["```", ""] if inside else []
            inside = line.strip() in SECTIONS
            out += [f"**{line.strip()}**", "", *(["```text"] if inside else [])]
        elif set(line) != {"-"} or not line:
            out.append(line)
    out += ["```"] if inside else []
    return [line for k, line in enumerate(out) if line or k == 0 or out[k - 1]]


if __name__ == "__main__":
    PAGE.write_text(text(), encoding="utf-8")
