"""Torque against angle by every model, and how far each is from the 3D finite elements."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from dftfs.analysis.study.result import StudyResult
from dftfs.analysis.torsion.result import SIGN, StiffnessResult, hermite
from dftfs.report.numbers import percent, plain, signed
from dftfs.report.style import (
    DIRECTION_COLOUR,
    DIRECTION_MARKER,
    GREEN,
    GREY,
    INK,
    ORANGE,
    ReportFigure,
    as_svg,
    house_style,
    new_figure,
)

_POINTS = 401
_BEYOND = 1.05  # of the 3D curve's range: as far as others are drawn
_NEAR_REST = 0.04  # of the range: closer to rest a ratio of torques is meaningless
_SMALLEST_WINDOW = 0.1  # percent


@dataclass(frozen=True, kw_only=True)
class ModelCurve:
    """One model's torque (n,) over deflection (n,), its stiffness at rest and contact onsets."""

    name: str
    colour: str
    dashes: str | tuple
    width: float
    deflection_rad: NDArray
    torque_Nm: NDArray
    stiffness_Nm_per_rad: float
    contact_onset: Mapping[str, object]
    wall_s: float | None = None


def model_curves(study: StudyResult) -> list[ModelCurve]:
    """Eq. 2.1, rod, 2D and 3D in this order, each with a colour and dashes of its own."""
    solid, planar, rod = study.solid, study.planar, study.rod
    ends = solid.deflection_rad[[0, -1]]
    order = np.argsort(rod.deflection_rad)
    rod_angle, rod_torque, rod_tangent = (
        np.asarray(values)[order]
        for values in (rod.deflection_rad, rod.torque_Nm, rod.tangent_Nm_per_rad)
    )
    # without contact the rod's curve extends far beyond that of the finite elements
    low, high = np.clip(rod_angle[[0, -1]], *(_BEYOND * ends))
    rod_fine = np.linspace(low, high, _POINTS)
    return [
        ModelCurve(
            name="eq. 2.1 (strip in pure bending)",
            colour=GREY,
            dashes=(0, (1, 1.2)),
            width=1.8,
            deflection_rad=ends,
            torque_Nm=study.eq_2_1_Nm_per_rad * ends,
            stiffness_Nm_per_rad=study.eq_2_1_Nm_per_rad,
            contact_onset={},
        ),
        ModelCurve(
            name="planar rod",
            colour=GREEN,
            dashes=(0, (6, 2, 1, 2)),
            width=1.6,
            deflection_rad=rod_fine,
            torque_Nm=hermite(rod_fine, rod_angle, rod_torque, rod_tangent),
            stiffness_Nm_per_rad=rod.stiffness_Nm_per_rad,
            contact_onset=study.rod_onset,
            wall_s=next((t for name, t in study.provenance.wall_s.items() if "rod" in name), None),
        ),
        _finite_elements(planar, ORANGE, (0, (5, 2)), 2.6),
        _finite_elements(solid, INK, "-", 1.2),
    ]


def _finite_elements(result: StiffnessResult, colour: str, dashes, width: float) -> ModelCurve:
    fine = np.linspace(*result.deflection_rad[[0, -1]], _POINTS)
    fine = np.union1d(fine, result.deflection_rad)
    return ModelCurve(
        name=result.model,
        colour=colour,
        dashes=dashes,
        width=width,
        deflection_rad=fine,
        torque_Nm=hermite(fine, result.deflection_rad, result.torque_Nm, result.tangent_Nm_per_rad),
        stiffness_Nm_per_rad=result.stiffness_Nm_per_rad,
        contact_onset=result.contact_onset,
        wall_s=result.wall_s,
    )


def torque_angle_figure(study: StudyResult) -> ReportFigure:
    """All models' curves with contact onsets and required torques; below, their distance to 3D."""
    curves = model_curves(study)
    with house_style():
        figure = new_figure(6.3)
        grid = figure.add_gridspec(2, 1, height_ratios=[2.5, 1.0])
        upper = figure.add_subplot(grid[0])
        lower = figure.add_subplot(grid[1], sharex=upper)
        for curve in curves:
            upper.plot(
                curve.deflection_rad,
                curve.torque_Nm,
                color=curve.colour,
                ls=curve.dashes,
                lw=curve.width,
                label=curve.name,
            )
        upper.plot(study.solid.deflection_rad, study.solid.torque_Nm, ".", color=INK, ms=5)
        _onsets(upper, curves)
        _asked(upper, study)
        upper.axhline(0, color=GREY, lw=0.6)
        upper.axvline(0, color=GREY, lw=0.6)
        upper.set_ylabel("torque (Nm)")
        upper.tick_params(labelbottom=False)
        degrees = upper.secondary_xaxis("top", functions=(np.degrees, np.radians))
        degrees.set_xlabel("deflection (degrees)")
        degrees.spines["top"].set_visible(True)
        figure.legend(*upper.get_legend_handles_labels(), loc="outside upper left", ncols=2)
        _residuals(lower, curves)
        lower.set_xlabel("deflection (rad)      − unwinding      + winding")
        return as_svg(
            figure,
            name="torque-angle",
            alt="Torque in Nm against deflection in rad and degrees by four models. "
            + " ".join(_onset_text(study.solid.contact_onset)),
            caption="Dots: computed states of the 3D model. Filled triangles: first contact of the"
            " coils by 3D, beyond which they press on each other; hollow: by the rod, whose curve"
            " ends there, and 2D. Below: torque of each"
            " model less that of 3D at the same angle, in percent of it.",
        )


def _onsets(axes: Axes, curves: list[ModelCurve]) -> None:
    for curve in curves:
        for direction, onset in curve.contact_onset.items():
            if onset is None:
                continue
            solid = curve is curves[-1]
            colour = DIRECTION_COLOUR[direction]
            axes.plot(
                onset.deflection_rad,
                onset.torque_Nm,
                DIRECTION_MARKER[direction],
                color=colour,
                mfc=colour if solid else "none",
                ms=9 if solid else 7,
                mew=1.0,
                zorder=5 if solid else 4,
            )
            if solid:
                _label_onset(axes, onset, direction)


def _label_onset(axes: Axes, onset, direction: str) -> None:
    """Text on an onset, in the quadrant across from its curve, where nothing is drawn."""
    right = SIGN[direction] > 0
    axes.annotate(
        f"first contact, {direction}\n{signed(onset.torque_Nm, 3)} Nm at"
        f" {signed(onset.deflection_rad, 3)} rad\n({signed(np.degrees(onset.deflection_rad), 3)}°)",
        xy=(0.985 if right else 0.015, 0),
        xycoords=axes.get_yaxis_transform(),
        xytext=(0, -7 if right else 7),
        textcoords="offset points",
        ha="right" if right else "left",
        va="top" if right else "bottom",
        color=DIRECTION_COLOUR[direction],
    )


def _asked(axes: Axes, study: StudyResult) -> None:
    """Limits that leave room for text in every quadrant, and the required torque in both."""
    asked = study.design.requirements.contact_free_torque_Nm
    reach = max(float(np.max(np.abs(study.solid.torque_Nm))), asked or 0.0)
    low, high = study.solid.torque_Nm[[0, -1]]
    axes.set_ylim(
        min(1.12 * low, -1.15 * (asked or 0.0), -0.55 * reach),
        max(1.12 * high, 1.15 * (asked or 0.0), 0.55 * reach),
    )
    if asked is None:
        return
    for sign in (+1, -1):
        axes.axhline(sign * asked, color=INK, lw=0.9, ls=(0, (2, 2)))
        axes.annotate(
            f"required contact-free: {signed(sign * asked, 3)} Nm",
            xy=(0.015 if sign > 0 else 0.985, sign * asked),
            xycoords=axes.get_yaxis_transform(),
            xytext=(0, 3),
            textcoords="offset points",
            ha="left" if sign > 0 else "right",
            fontsize=8.5,
        )


def residual_percent(curve: ModelCurve, reference: ModelCurve) -> tuple[NDArray, NDArray]:
    """Deflections (n,) that both cover, away from rest, and the difference in percent (n,)."""
    low = max(curve.deflection_rad[0], reference.deflection_rad[0])
    high = min(curve.deflection_rad[-1], reference.deflection_rad[-1])
    at = np.linspace(low, high, 241)
    at = at[np.abs(at) > _NEAR_REST * max(-low, high)]
    wanted = np.interp(at, reference.deflection_rad, reference.torque_Nm)
    return at, 100 * (np.interp(at, curve.deflection_rad, curve.torque_Nm) / wanted - 1)


def _residuals(axes: Axes, curves: list[ModelCurve]) -> None:
    reference = curves[-1]
    residuals = [(curve, *residual_percent(curve, reference)) for curve in curves[:-1]]
    models = np.concatenate([difference for _, _, difference in residuals[1:]])
    top = max(1.7 * float(np.max(np.abs(models))), _SMALLEST_WINDOW)
    for curve, at, difference in residuals:
        for side in (at < 0, at > 0):
            axes.plot(
                at[side], difference[side], color=curve.colour, ls=curve.dashes, lw=curve.width
            )
    closed = residuals[0][2]
    if np.min(np.abs(closed)) > top:
        up = np.mean(closed) > 0
        axes.text(
            0.01,
            0.96 if up else 0.05,
            f"eq. 2.1 off the scale: {percent(np.min(closed) / 100)} to"
            f" {percent(np.max(closed) / 100)}",
            transform=axes.transAxes,
            va="top" if up else "bottom",
            color=GREY,
            fontsize=8.5,
            bbox={"fc": "white", "ec": "none", "pad": 1.0},
        )
    axes.axhline(0, color=INK, lw=1.2)
    axes.axvline(0, color=GREY, lw=0.6)
    axes.set_ylim(-top, top)
    axes.set_ylabel("difference\nto 3D (%)")


def _onset_text(onsets: Mapping[str, object]) -> list[str]:
    return [
        f"First contact {direction} at {plain(abs(onset.torque_Nm), 3)} Nm."
        if onset is not None
        else f"No contact {direction} within the curve."
        for direction, onset in onsets.items()
    ]
