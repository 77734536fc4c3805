"""Argument parsing: errors of one line with the nearest match, examples in each help."""

import argparse
import difflib
from collections.abc import Collection

from dftfs.cli.budgets import add_budgets
from dftfs.cli.command_map import EXAMPLES


class StoreOnce(argparse.Action):
    """An option's value; the same option twice is a mistake, not a quiet choice of the last."""

    def __call__(self, parser, namespace, values, option_string=None):
        # the namespace remembers, not the action: a parser may read more than one line
        known = getattr(namespace, self.dest, self.default)
        if option_string is not None and known is not self.default:
            raise argparse.ArgumentError(self, "given twice")
        setattr(namespace, self.dest, values)


class OneLineParser(argparse.ArgumentParser):
    """An argument parser whose errors are one line, with exit status 2."""

    def __init__(self, *args, **kwargs) -> None:
        super().__init__(*args, formatter_class=argparse.RawDescriptionHelpFormatter, **kwargs)
        for name in (None, "store"):
            self.register("action", name, StoreOnce)

    def error(self, message: str) -> None:
        parts = self.prog.split()
        shown = EXAMPLES.get(parts[1], ()) if len(parts) > 1 else ()
        own = next((line for line in shown if line.startswith(self.prog)), "")
        example = f"; for example {own}" if own else ""
        self.exit(2, f"{self.prog}: {message}{example}; see {self.prog} --help\n")

    def _check_value(self, action, value) -> None:
        if action.choices is not None and value not in action.choices:
            raise argparse.ArgumentError(action, f"unknown {value!r}{_hint(value, action.choices)}")

    def refuse(self, unknown: list[str]) -> None:
        """End the program for parts that no argument took, with the nearest option."""
        known = [option for action in self._actions for option in action.option_strings]
        known += [option for nested in self.steps() for option in nested._option_string_actions]
        word = next((w for w in unknown if w.startswith("-")), unknown[0])
        hint = _hint(word.partition("=")[0], known) if word.startswith("-") else ""
        self.error(f"unrecognized arguments: {' '.join(unknown)}{hint}")

    def steps(self) -> list["OneLineParser"]:
        """The parsers of this command's own steps, as `prove` has them."""
        nested = [a for a in self._actions if isinstance(a, argparse._SubParsersAction)]
        return [step for action in nested for step in action.choices.values()]

    def add_common(self) -> None:
        """--quiet, -v, --time and --memory, which every command has, here and on its steps."""
        for where in (self, *self.steps()):
            known = where._option_string_actions
            if "--quiet" not in known:
                where.add_argument(
                    "-q", "--quiet", action="store_true", default=argparse.SUPPRESS,
                    help="print no progress",
                )  # fmt: skip
            if "--verbose" not in known:
                where.add_argument(
                    "-v", "--verbose", action="store_true", default=argparse.SUPPRESS,
                    help="print more progress, and where an internal error arose",
                )  # fmt: skip
            if "--time" not in known:
                add_budgets(where)


def examples(command: str) -> str:
    """The end of a command's help."""
    lines = EXAMPLES.get(command, (f"dftfs {command} --help",))
    return "\n".join(["examples:", *(f"  {line}" for line in lines)])


def _hint(value: object, known: Collection) -> str:
    near = difflib.get_close_matches(str(value)[:100], [str(k) for k in known], n=1, cutoff=0.5)
    if near:
        return f"; did you mean {near[0]}?"
    return f"; known are {', '.join(map(str, known))}" if len(known) < 12 else ""
