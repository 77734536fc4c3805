"""A sweep drawn: stiffness, first contact, first yield and mass over what was varied."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from dftfs.analysis.sweep.run import SweepResult
from dftfs.report.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    SKY,
    VERMILION,
    ReportFigure,
    as_png,
    house_style,
    new_figure,
)

_COLOURS = (BLUE, VERMILION, GREEN, ORANGE, SKY, INK, GREY)
_MARKERS = ("o", "s", "^", "D", "v", "P", "X")
_MOST_SERIES = 14
_UNIT_TEXTS = {"_mm": " (mm)", "_deg": " (degrees)", "_Nm_per_rad": " (Nm/rad)", "_Nm": " (Nm)"}


@dataclass(frozen=True, kw_only=True)
class _Series:
    """Rows with the same values of all varied fields but the one on the axis."""

    label: str
    rows: tuple[dict, ...]

    def values(self, name: str, scale: float = 1.0) -> np.ndarray:
        return np.array([np.nan if r[name] is None else scale * r[name] for r in self.rows])


def sweep_figure(result: SweepResult) -> ReportFigure:
    """Four panels over the numeric field with most values, a line per combination of the others.

    Points that failed are left out. Where no varied field is a number, points are numbered.
    """
    rows = [row for row in result.rows if row["status"] == "ok"]
    axis = _axis(result.fields, rows)
    series = _series(result.fields, rows, axis)
    shown = series[:_MOST_SERIES]
    with house_style():
        figure = new_figure(7.6, 9.0)
        panels = figure.subplots(2, 2, sharex=True)
        _stiffness(panels[0, 0], shown, axis)
        _contact(panels[0, 1], shown, axis)
        _strength(panels[1, 0], shown, axis)
        _mass(panels[1, 1], shown, axis)
        for panel in panels[1]:
            panel.set_xlabel(_label(axis))
        for panel in panels.flat:
            panel.set_ylim(bottom=0, top=1.05 * panel.get_ylim()[1])  # markers are whole
        if len(shown) > 1:
            handles, labels = panels[0, 0].get_legend_handles_labels()
            figure.legend(handles, labels, loc="outside upper left", ncols=min(4, len(shown)))
        sentences = [f"{rows[0]['model'] if rows else 'No result'}, {len(rows)} points."]
        sentences += [f"{result.failed} points failed and are not drawn."] if result.failed else []
        if len(series) > len(shown):
            sentences.append(f"The first {len(shown)} of {len(series)} lines.")
        return as_png(
            figure,
            name="sweep",
            alt=f"Stiffness, first contact, first yield and mass over {_label(axis)}.",
            caption=" ".join(sentences),
        )


def _axis(fields: Sequence[str], rows: Sequence[dict]) -> str:
    numeric = [f for f in fields if rows and all(isinstance(row[f], int | float) for row in rows)]
    return max(numeric, key=lambda f: len({row[f] for row in rows})) if numeric else "point"


def _series(fields: Sequence[str], rows: Sequence[dict], axis: str) -> list[_Series]:
    others = [name for name in fields if name != axis] if axis != "point" else []
    groups: dict[tuple, list[dict]] = {}
    for row in rows:
        groups.setdefault(tuple(row[name] for name in others), []).append(row)
    return [
        _Series(
            label=", ".join(
                value if isinstance(value, str) else f"{_label(name)} {value:g}"
                for name, value in zip(others, key)
                if value is not None
            ),
            rows=tuple(sorted(members, key=lambda row: row[axis])),
        )
        for key, members in groups.items()
    ]


def _draw(axes: Axes, series: Sequence[_Series], axis: str, column: str, **style) -> None:
    for k, one in enumerate(series):
        axes.plot(
            one.values(axis),
            np.abs(one.values(column, style.get("scale", 1.0))),
            color=_COLOURS[k % len(_COLOURS)],
            marker=_MARKERS[k % len(_MARKERS)],
            ms=4,
            ls=style.get("ls", "-"),
            mfc=style.get("mfc", _COLOURS[k % len(_COLOURS)]),
            label=one.label,
        )


def _stiffness(axes: Axes, series: Sequence[_Series], axis: str) -> None:
    _draw(axes, series, axis, "stiffness_Nm_per_rad")
    axes.set_title("Stiffness at rest")
    axes.set_ylabel("Nm/rad")


def _contact(axes: Axes, series: Sequence[_Series], axis: str) -> None:
    _draw(axes, series, axis, "contact_unwinding_Nm")
    _draw(axes, series, axis, "contact_winding_Nm", ls=(0, (4, 2)), mfc="white")
    axes.set_title("Torque at first contact")
    axes.set_ylabel("Nm (full unwinding, dashed winding)")


def _strength(axes: Axes, series: Sequence[_Series], axis: str) -> None:
    _draw(axes, series, axis, "first_yield_unwinding_Nm")
    _draw(axes, series, axis, "first_yield_winding_Nm", ls=(0, (4, 2)), mfc="white")
    operating = {row["operating_torque_Nm"] for one in series for row in one.rows} - {None}
    for torque in operating if len(operating) == 1 else ():
        axes.axhline(torque, color=INK, lw=0.9, ls=(0, (2, 2)))
        axes.annotate(
            f"operating torque {torque:g} Nm",
            xy=(0.99, torque),
            xycoords=axes.get_yaxis_transform(),
            xytext=(0, 3),
            textcoords="offset points",
            ha="right",
            fontsize=8,
        )
    axes.set_title("Torque at first yield, elastic")
    axes.set_ylabel("Nm (full unwinding, dashed winding)")


def _mass(axes: Axes, series: Sequence[_Series], axis: str) -> None:
    _draw(axes, series, axis, "mass_kg", scale=1e3)
    axes.set_title("Mass")
    axes.set_ylabel("g")


def _label(field: str) -> str:
    for ending, unit in _UNIT_TEXTS.items():
        if field.endswith(ending):
            return field.removesuffix(ending).replace("_", " ") + unit
    return field.replace("_", " ")
