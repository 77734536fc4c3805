"""The machine as a picture: drive, gear, spring, load, environment, sensors; located part marked.

Written as SVG directly, so that parts, labels and marks stay sharp and can be read out.
"""

import math
from collections.abc import Collection, Mapping

from markupsafe import escape

from dftfs.report.style import BLUE, GREY, INK, LIGHT, PART, VERMILION, ReportFigure

WIDTH, HEIGHT = 806, 312
AXIS_Y = 132
CENTRE = {"amplifier": 62, "motor": 160, "gear": 300, "spring": 446, "load": 606}
SENSOR_AT = {
    "current_A": (112, "current"),
    "motor_angle_rad": (200, "motor angle"),
    "spring_deflection_rad": (446, "deflection"),
    "torque_Nm": (528, "torque"),
    "load_angle_rad": (606, "load angle"),
    "temperature_C": (160, "temperature"),
}
BOX = {  # left, right, for frame and label of each part
    "drive": (22, 226),
    "gear": (246, 356),
    "spring": (388, 504),
    "load": (562, 668),
    "environment": (690, 790),
}


def machine_picture(
    *,
    parts: tuple[str, ...],
    sensors: tuple[str, ...],
    loads: tuple[str, ...],
    located: str | None,
    labels: Mapping[str, str],
    shares: Mapping[str, float],
    linked: Collection[str] = (),
) -> ReportFigure:
    """The machine from the side, left to right, as the power flows.

    Parameters
    ----------
    located : str or None
        Subsystem, or "sensor:<column>".
    labels : mapping of str to str
        Text at a part that is marked (the effect and its confidence).
    shares : mapping of str to float
        Share of the mismatch by subsystem.
    linked : collection of str
        Parts that lead to the page's place ``#part-NAME``.
    """
    has_contact, locked = "contact" in loads, all(load == "locked" for load in loads)
    shown = [p for p in ("drive", "gear", "spring", "load") if p in parts]
    if has_contact or locked:
        shown.append("environment")
    marked = {located} | set(labels)
    pieces = [_shaft(shown)]
    drawers = {"drive": _drive, "gear": _gear, "spring": _spring, "load": _load}
    for part in shown:
        colour = VERMILION if part in marked else INK
        environment = part == "environment"
        drawn = _environment(colour, locked=locked) if environment else drawers[part](colour)
        drawn += _label(part, part in marked, labels.get(part, ""), shares.get(part))
        pieces.append(_link(part, drawn) if part in linked else drawn)
    placed = [s for s in SENSOR_AT if s in sensors]
    for name in placed:
        hit = f"sensor:{name}" in marked
        pieces.append(_sensor(name, hit, labels.get(f"sensor:{name}", "")))
    shares_text = ", ".join(f"{p} {100 * shares[p]:.0f} %" for p in shown if p in shares)
    pointed = f"; marked: {located}" if located else "; nothing is marked"
    alt = (
        f"Machine with {', '.join(shown)}{pointed}. Share of the mismatch: {shares_text or 'none'}."
    )
    body = "\n".join(pieces)
    top = 0 if labels else 44  # no room kept for words and bars that are not there
    foot = HEIGHT if shares_text else 262
    svg = (
        f'<svg viewBox="0 {top} {WIDTH} {foot - top}" font-family="system-ui, sans-serif"'
        f' font-size="14" fill="none" stroke-linecap="round" stroke-linejoin="round">{body}</svg>'
    )
    caption = "Schematic of the machine."
    if shares_text:
        caption += " Bars: share of the mismatch that no parameter explains."
    if located is not None:
        caption += " Orange: where it arises."
    return ReportFigure(name="machine", alt=alt, caption=caption, svg=svg)


def _link(part: str, drawn: str) -> str:
    """A part that can be clicked, or reached by the keyboard, anywhere in its frame."""
    left, right = BOX[part]
    area = f'<rect x="{left}" y="50" width="{right - left}" height="210" fill="#fff"'
    title = f"<title>What is missing at the {part}</title>"
    return f'<a href="#part-{part}">{title}{area} fill-opacity="0"/>{drawn}</a>'


def _shaft(shown: list[str]) -> str:
    at = [CENTRE["motor" if part == "drive" else part] for part in shown if part != "environment"]
    left, right = min(at), max(at)
    if "load" not in shown and "environment" in shown:
        right = CENTRE["load"]
    if right <= left:
        return ""
    return f'<path d="M{left} {AXIS_Y}H{right}" stroke="{GREY}" stroke-width="5"/>'


def _drive(colour: str) -> str:
    amplifier, motor = CENTRE["amplifier"], CENTRE["motor"]
    y = AXIS_Y
    return (
        f'<path d="M{amplifier + 26} {y - 14}H{motor - 34}M{amplifier + 26} {y + 14}H{motor - 34}"'
        f' stroke="{colour}" stroke-width="1.6"/>'
        f'<rect x="{amplifier - 26}" y="{y - 30}" width="52" height="60" rx="4"'
        f' fill="{PART}" stroke="{colour}" stroke-width="2"/>'
        f'<path d="M{amplifier - 16} {y + 10}h8v-20h10v20h8v-20h6" stroke="{colour}"'
        ' stroke-width="1.8"/>'
        f'<rect x="{motor - 34}" y="{y - 34}" width="62" height="68" rx="8" fill="{PART}"'
        f' stroke="{colour}" stroke-width="2"/>'
        f'<text x="{motor - 3}" y="{y + 8}" fill="{colour}" text-anchor="middle" font-size="24">'
        "M</text>"
    )


def _gear(colour: str) -> str:
    x, y, radius, teeth = CENTRE["gear"], AXIS_Y, 40.0, 20
    points = []
    for k in range(4 * teeth):
        r = radius + (5.0 if k % 4 in (1, 2) else -2.0)
        angle = 2 * math.pi * (k + 0.5) / (4 * teeth)
        points.append(f"{x + r * math.cos(angle):.1f},{y + r * math.sin(angle):.1f}")
    threads = "".join(
        f'<path d="M{x - 34 + 11 * k} {y - 66}l7 18" stroke="{colour}" stroke-width="2"/>'
        for k in range(6)
    )
    return (
        f'<rect x="{x - 38}" y="{y - 67}" width="76" height="20" rx="8" fill="{PART}"'
        f' stroke="{colour}" stroke-width="1.6"/>{threads}'
        f'<polygon points="{" ".join(points)}" fill="{PART}" stroke="{colour}"'
        ' stroke-width="2"/>'
        f'<circle cx="{x}" cy="{y}" r="9" fill="#fff" stroke="{colour}" stroke-width="2"/>'
    )


def _spring(colour: str) -> str:
    x, y = CENTRE["spring"], AXIS_Y
    arms = []
    for arm in (0.0, math.pi):
        points = []
        for k in range(61):
            turn = k / 60.0
            r = math.sqrt(11.0**2 + turn * (39.0**2 - 11.0**2))
            angle = arm + 1.9 * 2 * math.pi * turn
            points.append(f"{x + r * math.cos(angle):.1f} {y + r * math.sin(angle):.1f}")
        arms.append("M" + "L".join(points))
    return (
        f'<circle cx="{x}" cy="{y}" r="44" fill="{PART}" stroke="{colour}" stroke-width="2"/>'
        f'<circle cx="{x}" cy="{y}" r="39" fill="#fff" stroke="{colour}" stroke-width="1.4"/>'
        f'<path d="{"".join(arms)}" stroke="{colour}" stroke-width="3"/>'
        f'<circle cx="{x}" cy="{y}" r="10" fill="{PART}" stroke="{colour}" stroke-width="2"/>'
    )


def _load(colour: str) -> str:
    x, y = CENTRE["load"], AXIS_Y
    tip_x, tip_y = x + 30, y + 78
    return (
        f'<path d="M{x} {y}L{tip_x} {tip_y}" stroke="{colour}" stroke-width="9"/>'
        f'<path d="M{x} {y}L{tip_x} {tip_y}" stroke="{PART}" stroke-width="5"/>'
        f'<circle cx="{tip_x}" cy="{tip_y}" r="15" fill="{PART}" stroke="{colour}"'
        ' stroke-width="2"/>'
        f'<circle cx="{x}" cy="{y}" r="11" fill="#fff" stroke="{colour}" stroke-width="2"/>'
    )


def _environment(colour: str, *, locked: bool) -> str:
    x, y = 728, AXIS_Y + 74
    hatch = "".join(f"M{x + 30} {y - 74 + 14 * k}l14 -12" for k in range(8))
    wall = f'<path d="M{x + 30} {y - 82}V{y + 22}{hatch}" stroke="{colour}" stroke-width="1.8"/>'
    if locked:
        return wall + (f'<path d="M630 {AXIS_Y}H{x + 30}" stroke="{colour}" stroke-width="4"/>')
    zigzag = "".join(f"l6 {10 if k % 2 else -10}" for k in range(6))
    return wall + (
        f'<path d="M{x - 36} {y}h8l3 5{zigzag}l3 -5H{x + 30}M{x - 36} {y - 16}v32"'
        f' stroke="{colour}" stroke-width="2"/>'
    )


def _label(part: str, marked: bool, shares_text: str, share: float | None) -> str:
    left, right = BOX[part]
    middle = 0.5 * (left + right)
    colour = VERMILION if marked else INK
    weight = ' font-weight="700"' if marked else ""
    found = f'<text x="{middle}" y="252" text-anchor="middle" fill="{colour}"{weight}>{part}</text>'
    if marked:
        found = (
            f'<rect x="{left}" y="50" width="{right - left}" height="182" rx="12"'
            f' stroke="{VERMILION}" stroke-width="3.5" stroke-dasharray="1 0"/>' + found
        )
    if shares_text:
        found += (
            f'<text x="{middle}" y="34" text-anchor="middle" fill="{VERMILION}"'
            f' font-weight="700">{escape(shares_text)}</text>'
        )
    if share is not None:
        width = 84.0
        x = middle - 0.5 * width
        found += (
            f'<rect x="{x}" y="262" width="{width}" height="11" rx="2" fill="{LIGHT}"/>'
            f'<rect x="{x}" y="262" width="{width * min(max(share, 0.0), 1.0):.1f}" height="11"'
            f' rx="2" fill="{colour if marked else GREY}"/>'
            f'<text x="{middle}" y="292" text-anchor="middle" fill="{colour}" font-size="13">'
            f"{100 * share:.0f} %</text>"
        )
    return found


def _sensor(name: str, hit: bool, shares_text: str) -> str:
    x, label = SENSOR_AT[name]
    colour = VERMILION if hit else BLUE
    top, foot = 66, 82
    ring = f'<circle cx="{x}" cy="{AXIS_Y}" r="12" stroke="{VERMILION}" stroke-width="3.5"/>'
    text = (
        f'<text x="{x}" y="34" text-anchor="middle" fill="{VERMILION}" font-weight="700">'
        f"{escape(shares_text)}</text>"
        if shares_text
        else ""
    )
    return (
        f'<path d="M{x} {AXIS_Y - 6}V{foot}" stroke="{colour}" stroke-width="1.4"'
        ' stroke-dasharray="3 4"/>'
        f'<circle cx="{x}" cy="{AXIS_Y}" r="5" fill="{colour}"/>'
        f'<text x="{x}" y="{top}" text-anchor="middle" fill="{colour}" font-size="12">'
        f"{label}</text>{ring if hit else ''}{text}"
    )
