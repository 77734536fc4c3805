"""How surely a diagnosis knows the machine that it found: spreads of its values for a Monte Carlo.

`diagnosis.json` states a standard deviation for every corrected value of the rig and for the
parameters of every effect; the machine itself is the `model.toml` beside it. Values are drawn
independently: the file states no correlations, so that pairs of which only a product or a sum was
seen (supply and resistance) scatter more in a Monte Carlo than the diagnosis leaves open.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rsea_core.errors import RigError
from rsea_core.model.actuator_model import ActuatorModel

SAME = 1e-3  # relative: a value of the document and the machine's own


@dataclass(frozen=True, kw_only=True)
class Posterior:
    """Spreads of a diagnosed machine.

    Attributes
    ----------
    deviations : mapping
        Standard deviation, in the quantity's own unit, of a field of the rig, or of
        "effect.parameter" of a term.
    held : tuple of str
        What the document gives a spread for and no field or parameter of the machine carries.
    """

    deviations: Mapping[str, float]
    held: tuple[str, ...]

    @property
    def note(self) -> str | None:
        """What does not scatter, in words; None where all does."""
        if not self.held:
            return None
        return f"not varied, the machine has no value of that name: {', '.join(self.held)}"


def read_posterior(path: str | Path, model: ActuatorModel) -> Posterior:
    """The spreads that a `diagnosis.json` states for the machine of its `model.toml`.

    Raises
    ------
    RigError
        If the file is no diagnosis, or one of another machine.
    """
    document = _document(Path(path))
    deviations, held = {}, []
    for key, found in document["parameters_corrected"].items():
        std, value = found.get("std"), found.get("to")
        if not std or value is None:
            continue
        own = _own_value(model, key)
        if own is None:
            held.append(key)
            continue
        _require_same(path, key, value, own)
        deviations[key] = float(std)
    for effect in document["effects"]:
        for name, found in effect["parameters"].items():
            key = f"{effect['name']}.{name}"
            std, value = found.get("std"), found.get("value")
            if not std or not isinstance(value, float | int):
                continue
            own = _own_value(model, key)
            if own is None:
                held.append(key)
                continue
            _require_same(path, key, value, own)
            deviations[key] = float(std)
    return Posterior(deviations=deviations, held=tuple(held))


def _own_value(model: ActuatorModel, key: str) -> float | None:
    """A field of the rig, or "effect.parameter" of its one term; None where it has none."""
    effect, _, name = key.partition(".")
    if not name:
        return getattr(model.rig, key, None)
    own = [term for term in model.terms if term.effect == effect]
    value = getattr(own[0], name, None) if len(own) == 1 else None
    return value if isinstance(value, float) else None


def _document(path: Path) -> Mapping:
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        corrected, effects = document["parameters_corrected"], document["effects"]
        tables = [corrected, *(effect["parameters"] for effect in effects if effect["name"])]
        figures = [value for table in tables for value in table.values()]
        numbers = [figure.get(name) for figure in figures for name in ("std", "to")]
        if not all(number is None or isinstance(number, float | int) for number in numbers):
            raise ValueError("a figure that is no number")
    except OSError as problem:
        raise RigError(f"{path}: cannot be read: {problem.strerror}") from problem
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as problem:
        raise RigError(f"{path}: is not the diagnosis.json of dftfs diagnose") from problem
    return document


def _require_same(path: str | Path, key: str, stated: float, own: float) -> None:
    if abs(stated - own) > SAME * max(abs(stated), abs(own)):
        raise RigError(
            f"{path}: {key} = {stated:.6g} there, {own:.6g} here: it is of another machine; take"
            " the model.toml beside it as the rig"
        )
