"""Whether the data of two pages say the same: every value by its place, without times and paths."""

import dataclasses
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

NOT_COMPARED = {
    *("facts", "provenance", "date", "paths", "files"),
    *("wall_s", "search_wall_s", "seconds"),
}
_PASSING = re.compile(r"\S*/\S+|\S+\.\w{2,5}$|\d+(\.\d+)? s in all")  # names of files, time taken
_HASH = "SHA-256 of "


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """What became of the values of a page.

    Attributes
    ----------
    values : int
        Numbers, words and flags that were compared; an array counts with all its elements.
    differing : tuple of (place, first, second)
        Those that differ by more than the tolerance, or that only one page has.
    largest : float
        Largest relative difference of numbers that are within the tolerance; 0 is bit for bit.
    changed_inputs : tuple of str
        Files whose content is another one now.
    """

    values: int
    differing: tuple[tuple[str, str, str], ...]
    largest: float
    changed_inputs: tuple[str, ...]


def compare(first: object, second: object, tolerance: float) -> Comparison:
    """Compare the values of two pages; numbers relative to the larger, arrays to their largest."""
    one, other = dict(leaves(first)), dict(leaves(second))
    differing, largest, count = [], 0.0, 0
    for place in sorted({*one, *other}):
        a, b = one.get(place, "absent"), other.get(place, "absent")
        count += a.size if isinstance(a, np.ndarray) else 1
        gap = _gap(a, b)
        if gap > tolerance:
            differing.append((place.lstrip("."), _short(a), _short(b)))
        else:
            largest = max(largest, gap)
    hashes = [{k: v for k, v in facts(x) if k.startswith(_HASH)} for x in (first, second)]
    changed = [k for k in hashes[0] if hashes[1].get(k) != hashes[0][k]]
    return Comparison(
        values=count, differing=tuple(differing), largest=largest,
        changed_inputs=tuple(name.removeprefix(_HASH) for name in changed),
    )  # fmt: skip


def leaves(value: object, place: str = "") -> Iterator[tuple[str, object]]:
    """Every plain value and array inside a page's data, with its place; no path, time or fact."""
    if isinstance(value, Mapping):
        inner = value.items()
    elif isinstance(value, list | tuple | frozenset):
        ordered = sorted(value, key=repr) if isinstance(value, frozenset) else value
        inner = enumerate(ordered)
    elif dataclasses.is_dataclass(value) and not hasattr(value, "__dict__"):
        inner = ((f.name, getattr(value, f.name)) for f in dataclasses.fields(value))
    elif hasattr(value, "__dict__") and not isinstance(value, type):
        inner = vars(value).items()
    else:
        if not isinstance(value, Path):
            yield place, _PASSING.sub("", value) if isinstance(value, str) else value
        return
    for key, content in inner:
        if key not in NOT_COMPARED:
            yield from leaves(content, f"{place}.{key}")


def facts(value: object) -> tuple[tuple[str, str], ...]:
    """The provenance that a page states, wherever its data hold it."""
    if isinstance(value, Mapping) and value.get("facts"):
        return tuple(value["facts"])
    inner = value.values() if isinstance(value, Mapping) else ()
    for own in inner:
        found = getattr(own, "facts", None) or getattr(own, "provenance", None)
        if found:
            return tuple(found)
    return ()


def _gap(a: object, b: object) -> float:
    """Relative difference; infinite where two values cannot be compared as numbers."""
    numbers = (int, float, complex, np.ndarray)
    if isinstance(a, numbers) and isinstance(b, numbers):
        a, b = np.asarray(a), np.asarray(b)
        if a.shape == b.shape and a.dtype.kind in "biufc" and b.dtype.kind in "biufc":
            if np.array_equal(a, b, equal_nan=True):
                return 0.0
            scale = max(np.nanmax(np.abs(a)), np.nanmax(np.abs(b)))
            gaps = np.abs(a - b)[~(np.isnan(a) & np.isnan(b))] / scale
            return float(gaps.max()) if np.isfinite(gaps).all() else np.inf
        return 0.0 if np.array_equal(a, b) else np.inf
    return 0.0 if repr(a) == repr(b) else np.inf


def _short(value: object) -> str:
    if isinstance(value, np.ndarray):
        return f"array {value.shape}"
    text = " ".join(repr(value).split())
    return text if len(text) < 50 else f"{text[:47]}..."
