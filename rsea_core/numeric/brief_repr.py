"""A representation of results in a few lines: arrays by shape and range, not by their numbers."""

import math
from dataclasses import fields, is_dataclass
from html import escape

MOST_LINES = 12
WIDTH = 88


class BriefRepr:
    """Base of frozen dataclasses (`repr=False`) that hold arrays or many values."""

    def __repr__(self) -> str:
        shown = [f for f in fields(self) if f.repr]
        lines = [f"  {f.name}: {brief(getattr(self, f.name))}" for f in shown[:MOST_LINES]]
        if len(shown) > MOST_LINES:
            lines.append(f"  ... and {len(shown) - MOST_LINES} more")
        return "\n".join([type(self).__name__, *lines])

    def _repr_html_(self) -> str:
        """The same in a notebook: a table with every field."""
        rows = "".join(
            f"<tr><th>{escape(f.name)}</th><td>{escape(brief(getattr(self, f.name)))}</td></tr>"
            for f in fields(self)
            if f.repr
        )
        return f"<table><caption>{escape(type(self).__name__)}</caption>{rows}</table>"


def brief(value: object) -> str:
    """One value on one line."""
    if hasattr(value, "shape") and hasattr(value, "dtype"):
        return _array(value)
    if isinstance(value, float):
        return f"{value:.6g}"
    if is_dataclass(value) and not isinstance(value, type):
        named = (getattr(value, key, None) for key in ("name", "kind", "file"))
        name = next((given for given in named if given), None)
        return type(value).__name__ + (f" {name!r}" if isinstance(name, str) else "")
    if isinstance(value, dict | list | tuple) and len(value) > 0:
        inside = ", ".join(brief(v) for v in list(value)[:4])
        more = ", ..." if len(value) > 4 else ""
        return _cut(f"{len(value)} of: {inside}{more}")
    return _cut(repr(value))


def _array(value) -> str:
    shape = "x".join(map(str, value.shape))
    if value.size == 0 or value.dtype.kind not in "fiu":
        return f"({shape}) array"
    low, high = float(value.min()), float(value.max())
    inside = f", {low:.4g} to {high:.4g}" if math.isfinite(low) and math.isfinite(high) else ""
    return f"({shape}) array{inside}"


def _cut(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= WIDTH else text[: WIDTH - 4] + " ..."
