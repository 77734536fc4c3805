"""Writes docs/commands.md from the parsers: `python docs/commands.py`."""

import argparse
import os
from pathlib import Path

from dftfs.cli.command_map import EXAMPLES, GROUPS
from dftfs.cli.main import SENTENCES, parser

PAGE = Path(__file__).with_name("commands.md")


def text() -> str:
    """The page."""
    placed = {name for names in GROUPS.values() for name in names}
    lines = [
        "# Every command",
        "",
        "Made from the parsers by `python docs/commands.py`. Every command takes `-h`, `-q`"
        " (`--quiet`), `-v` (`--verbose`), `--time SECONDS` and `--memory GB`.",
        "Exit statuses: [troubleshooting](troubleshooting.md).",
    ]
    for group, names in GROUPS.items():
        rest = [name for name in SENTENCES if name not in placed] if group == "other" else []
        lines += ["", f"## {group[0].upper()}{group[1:]}"]
        for name in (*names, *rest):
            lines += _command(name)
    return "\n".join(lines) + "\n"


def _command(name: str) -> list[str]:
    top = parser([name])
    found = next(a for a in top._actions if isinstance(a, argparse._SubParsersAction))
    own = found.choices[name]
    lines = ["", f"### dftfs {name}", "", f"{_sentence(SENTENCES[name])}", ""]
    lines += ["```", *EXAMPLES.get(name, (f"dftfs {name} --help",)), "```"]
    for step in dict.fromkeys([own, *own.steps()]):  # an alias is the same parser
        rows = [_row(step, action) for action in step._actions if _shown(action)]
        if rows:
            head = step.prog if step is not own else "argument"
            lines += ["", f"| {head} | meaning |", "| --- | --- |", *rows]
    return lines


def _shown(action: argparse.Action) -> bool:
    common = {"help", "quiet", "verbose", "time", "most_GB"}
    return action.dest not in common and not isinstance(action, argparse._SubParsersAction)


def _row(step: argparse.ArgumentParser, action: argparse.Action) -> str:
    value = action.metavar or (
        f"{{{','.join(map(str, action.choices))}}}" if action.choices else ""
    )
    value = value or ("" if action.nargs == 0 or not action.option_strings else action.dest.upper())
    value = " ".join(value) if isinstance(value, tuple) else value
    names = ", ".join(action.option_strings) or value or action.dest
    shown = f"{names} {value}".strip() if action.option_strings else names
    meaning = (action.help or "").replace("%(default)s", str(action.default)).replace("%%", "%")
    if action.dest == "jobs":
        meaning += " (default: all cores)" if "default" not in meaning else ""
    return f"| `{shown}` | {meaning} |".replace("\n", " ").replace("{|", "{")


def _sentence(line: str) -> str:
    return f"{line[0].upper()}{line[1:]}."


if __name__ == "__main__":
    os.environ["COLUMNS"] = "100"
    PAGE.write_text(text(), encoding="utf-8")
