"""The option --effects: files with physics of the user's own."""

import argparse
from collections.abc import Callable
from pathlib import Path


def add_effects(parser: argparse.ArgumentParser) -> None:
    """--effects."""
    parser.add_argument(
        "--effects",
        action="append",
        default=[],
        type=Path,
        metavar="FILE.py",
        help="Python file with your own effects (docs/adding-an-effect.md; repeatable)",
    )


def load_own_effects(arguments: argparse.Namespace, say: Callable[[str], None]) -> None:
    """Register the effects of --effects; say so where one is slow.

    Raises
    ------
    rsea_core.errors.TermError
        If a file has no effect that can be used.
    """
    if not arguments.effects:
        return
    from rsea_core.effects.user_effects import load_effects, speed_note  # compiles: seconds

    for path in arguments.effects:
        for kind in load_effects(path):
            say(f"{path}: {kind.effect}, {kind.law}")
    note = speed_note()
    if note is not None:
        say(note)
