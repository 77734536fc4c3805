"""Effects of users: a file with a class of the same kind as those of this package.

`dftfs ... --effects my_effect.py` and `load_effects` read one; `register` takes a class. Such an
effect is simulated by both engines, fitted, screened, drawn, reported and written to model.toml
like any other. It has no internal states, and its laws are torques and friction levels (`hooks`).
"""

import dataclasses
import importlib.util
import inspect
import sys
import traceback
from pathlib import Path

from rsea_core.effects.base import Port, Term
from rsea_core.effects.hooks import OUTSIDE_HOOKS
from rsea_core.effects.registry import LAWS, TERMS
from rsea_core.errors import TermError

NAMED = ("effect", "law", "port", "headline")


def register(kind: type[Term]) -> type[Term]:
    """Take a user's effect into the registry; a class decorator.

    Raises
    ------
    TermError
        If the class is no frozen dataclass of a `Term`, lacks a name, or has one that is taken.
    """
    name = getattr(kind, "__name__", repr(kind))
    if not (inspect.isclass(kind) and issubclass(kind, Term)):
        raise TermError(f"{name} is no effect: derive it from rsea_core.effects.Term")
    if not dataclasses.is_dataclass(kind) or not kind.__dataclass_params__.frozen:
        raise TermError(f"{name} must be a @dataclass(frozen=True, kw_only=True)")
    lacking = next((n for n in NAMED if not getattr(kind, n, None)), None)
    if lacking is not None:
        raise TermError(f"{name} lacks the class attribute {lacking}")
    if kind.port not in (Port.GEAR, Port.LOAD):
        raise TermError(f"{name}: port must be Port.GEAR or Port.LOAD")
    if kind.law in LAWS.get(kind.effect, {}):
        raise TermError(f"{name}: effect {kind.effect!r}, law {kind.law!r} is there already")
    if not kind(**_starts(kind)).numbers(_Plain()):
        raise TermError(f"{name}: numbers() gives none, so that no hook can read it")
    LAWS.setdefault(kind.effect, {})[kind.law] = kind
    TERMS.setdefault(kind.effect, kind)
    return kind


class _Plain:
    """A gear of ratio one."""

    ratio = 1.0

    def torque_to_output(self, motor_side: float) -> float:
        return motor_side

    def motion_to_output(self, motor_side: float) -> float:
        return motor_side


def _starts(kind: type[Term]) -> dict[str, float]:
    """A value for each parameter: its start, its default, else the middle of its bounds."""
    found = {}
    for f in dataclasses.fields(kind):
        if f.default is dataclasses.MISSING:
            if "bounds" not in f.metadata:
                raise TermError(f"{kind.__name__}: {f.name} is no parameter(...)")
            fit, (low, high) = f.metadata.get("fit"), f.metadata["bounds"]
            value = 0.5 * (low + high) if fit is None else fit.starts[0]
            found[f.name] = min(max(value, low), high)
    return found


def load_effects(path: str | Path) -> tuple[type[Term], ...]:
    """Read a file of effects and register every class in it that derives from `Term`.

    Raises
    ------
    TermError
        In one line, if the file cannot be read or run, or has no effect that can be used.
    """
    path = Path(path)
    spec = importlib.util.spec_from_file_location(f"user_effects_{path.stem}", path)
    if spec is None or not path.is_file():
        raise TermError(f"{path}: no Python file with an effect")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    try:
        spec.loader.exec_module(module)
    except Exception as problem:
        raise TermError(f"{path}{_line_of(problem, path)}: {_message(problem)}") from problem
    own = [
        kind
        for kind in vars(module).values()
        if inspect.isclass(kind) and issubclass(kind, Term) and kind.__module__ == spec.name
    ]
    if not own:
        raise TermError(f"{path}: has no class that derives from rsea_core.effects.Term")
    try:
        for kind in own:
            if LAWS.get(getattr(kind, "effect", ""), {}).get(kind.law) is not kind:
                register(kind)
    except TermError as problem:
        raise TermError(f"{path}: {problem}") from None
    except Exception as problem:
        raise TermError(f"{path}{_line_of(problem, path)}: {_message(problem)}") from problem
    return tuple(own)


def speed_note() -> str | None:
    """What to know of the speed of users' effects; None where all are compiled."""
    OUTSIDE_HOOKS.address()
    if not OUTSIDE_HOOKS.interpreted:
        return None
    return (
        "a law of --effects does not compile by numba and is called in Python: simulations and"
        " fits are some hundred times slower"
    )


def _message(problem: Exception) -> str:
    return " ".join(f"{type(problem).__name__}: {problem}".split())


def _line_of(problem: Exception, path: Path) -> str:
    if isinstance(problem, SyntaxError):
        return f", line {problem.lineno}"
    lines = [
        f.lineno for f in traceback.extract_tb(problem.__traceback__) if f.filename == str(path)
    ]
    return f", line {lines[-1]}" if lines else ""
