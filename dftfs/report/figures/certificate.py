"""The certificate of a spring as a page of PDF: what is stated, judged, and the curve."""

import io
import textwrap

import numpy as np

from dftfs.analysis.strength.checks import Check
from dftfs.analysis.study.delivery import Certificate
from dftfs.report.style import BLUE, GREY, INK, VERMILION, house_style, new_figure

_INCHES = (11.69, 8.27)  # height and width of A4
_VERDICT = {True: "pass", False: "FAIL", None: "open"}
_LEFT, _VALUES, _LINE = 0.08, 0.40, 0.0185
_CHARACTERS = 72


def certificate_pdf(found: Certificate, *, part: str, date: str) -> bytes:
    """One page A4."""
    with house_style():
        figure = new_figure(*_INCHES)
        figure.set_layout_engine("none")
        title = f"Certificate of computed values: {part}"
        figure.text(_LEFT, 0.95, title, fontsize=15, weight="bold", color=INK)
        note = f"{date}; elastic, to first contact; to be confirmed by measuring the part"
        figure.text(_LEFT, 0.928, note, color=GREY, fontsize=9)
        y = 0.905
        for name, value in found.lines:
            lines = textwrap.wrap(value, _CHARACTERS)
            for at, text, colour in ((_LEFT, name, GREY), (_VALUES, "\n".join(lines), INK)):
                figure.text(at, y, text, fontsize=8.5, va="top", color=colour)
            y -= _LINE * len(lines)
        y -= _LINE
        for check in found.checks:
            colour = VERMILION if check.passed is False else INK
            figure.text(_LEFT, y, _judged(check), fontsize=8.5, va="top", color=colour)
            y -= _LINE
        _curve(figure.add_axes((0.11, 0.08, 0.82, max(y - 0.14, 0.2))), found)
        stream = io.BytesIO()
        figure.savefig(stream, format="pdf", metadata={"CreationDate": None})
        return stream.getvalue()


def _judged(check: Check) -> str:
    value = "-" if check.value is None else f"{check.value:.4g} {check.unit}".strip()
    return f"{_VERDICT[check.passed]}   {check.name}: {value}, required {check.limit}"


def _curve(axes, found: Certificate) -> None:
    result = found.curve
    axes.plot(np.degrees(result.deflection_rad), result.torque_Nm, color=BLUE, marker="o", ms=3)
    for direction, onset in result.contact_onset.items():
        if onset is not None:
            at, side = float(np.degrees(onset.deflection_rad)), np.sign(onset.deflection_rad)
            axes.plot(at, onset.torque_Nm, "s", color=VERMILION, ms=6)
            axes.annotate(
                f"first contact, {direction}",
                (at, onset.torque_Nm),
                xytext=(-8 * side, 0),
                textcoords="offset points",
                ha="right" if side > 0 else "left",
                va="center",
                fontsize=8,
            )
    axes.set_xlabel("deflection of the rim (degrees, + winds)")
    axes.set_ylabel("torque (Nm)")
