"""The report of a diagnosis: one HTML file, self-contained."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from dftfs.report.diagnosis import figures as draw
from dftfs.report.diagnosis.machine_picture import machine_picture
from dftfs.report.diagnosis.page import Comparison, DiagnosisPage
from dftfs.report.numbers import percent, plain, with_uncertainty
from dftfs.report.page import page_environment, render_page
from dftfs.report.page_data import write_page
from dftfs.report.style import ReportFigure

_UNIT_ENDING = re.compile(r"_(?:[A-Z]\w*|ohm|m|kg|kgm2|rad)$")  # of a rig's field
COMPARED = 4  # recordings and signals drawn in full; the table has all of them
LOCATED = {"mismatch-time", "mismatch-state", "port-torques"}  # a quick look draws none of them
PART_OF = {"V": "drive", "G": "gear", "S": "spring", "L": "load"}  # by port
TRACED = 3  # recordings whose port torques are drawn


@dataclass(frozen=True, kw_only=True)
class KeyFigure:
    """A number of the first screen."""

    label: str
    value: str
    note: str


def write_diagnosis_report(page: DiagnosisPage, path: Path) -> Path:
    """Write the report as one self-contained HTML file, whole or not at all.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    return write_page(path, "diagnosis", page=page)


def render_diagnosis(page: DiagnosisPage) -> str:
    """The report's HTML."""
    environment = page_environment()
    environment.globals |= {
        "plain": plain,
        "percent": percent,
        "with_uncertainty": with_uncertainty,
        "quantity": draw.quantity,
        "parameter_text": parameter_text,
    }
    figures = diagnosis_figures(page)
    located = page.separability or page.signatures or figures.keys() & LOCATED
    return render_page(
        environment,
        "diagnosis.html",
        figures.values(),
        "diagnosis.css",
        page=page,
        facts=page.facts,
        figures=figures,
        located=bool(located),
        numbers=key_figures(page),
        findings=page.findings,
        compared=range(min(len(page.comparisons), COMPARED)),
        laws=range(len(page.laws)),
        parts=traced_parts(page),
    )


def diagnosis_figures(page: DiagnosisPage) -> Mapping[str, ReportFigure]:
    """Every figure of the page by name."""
    labels = {}
    for effect in page.effects:
        if effect.confidence >= 0.5:
            effect_label = f"{effect.name.split('-', 1)[-1]} {100 * effect.confidence:.0f} %"
            labels[effect.subsystem] = ", ".join(
                filter(None, (labels.get(effect.subsystem), effect_label))
            )
    found = [
        machine_picture(
            parts=page.parts,
            sensors=page.sensors,
            loads=page.loads,
            located=page.subsystem,
            labels=labels,
            shares=page.shares if page.subsystem else {},  # shares of noise point to no part
            linked=traced_parts(page),
        )
    ]
    ordered = sorted(
        page.comparisons, key=lambda c: (c.role != "validation", _improvement(c, page))
    )
    found += [draw.comparison_figure(c, k) for k, c in enumerate(ordered[:COMPARED])]
    found += [draw.law_figure(law, k) for k, law in enumerate(page.laws)]
    if page.traces:
        traces = draw.by_file(page.traces, TRACED)
        found.append(draw.trace_figure(traces))
        for part in traced_parts(page):
            own = tuple(t for t in traces if PART_OF.get(t.port) == part)
            found.append(draw.trace_figure(own, f"part-{part}"))
    if page.strips:
        found.append(draw.strip_figure(page.strips))
    if page.state_map is not None:
        found.append(draw.state_figure(page.state_map))
    if page.ladder:
        found.append(draw.ranked_explanations_figure(page.ladder, page.weighed))
    if page.remainder is not None:
        found.append(draw.remainder_figure(page.remainder))
    if page.next_experiment is not None:
        found.append(draw.next_figure(page.next_experiment))
    return {figure.name: figure for figure in found}


def traced_parts(page: DiagnosisPage) -> tuple[str, ...]:
    """Parts of the machine whose missing torque is drawn when they are clicked."""
    ports = {t.port for t in draw.by_file(page.traces, TRACED)}
    return tuple(part for port, part in PART_OF.items() if port in ports and part in page.parts)


def parameter_text(name: str) -> str:
    """A rig's field in words, without the unit that has a column of its own."""
    return _UNIT_ENDING.sub("", name).replace("_", " ")


def _improvement(item: Comparison, page: DiagnosisPage) -> tuple[float, float]:
    """Ordered so that the channel that improved most leads; without a model the worst one.

    Laws improve on what parameters alone leave.
    """
    begun = item.nrmse_parameters_only if page.effects else None
    begun = item.nrmse_before if begun is None else begun
    left = 1.0 if item.nrmse_after is None else item.nrmse_after / max(begun, 1e-12)
    return left, -item.nrmse_before


def key_figures(page: DiagnosisPage) -> tuple[KeyFigure, ...]:
    """The numbers of the first screen, those that this page has."""
    found = []
    held = [c for c in page.comparisons if c.role == "validation"] or list(page.comparisons)
    if held:
        worst = min(held, key=lambda item: _improvement(item, page))
        steps = (worst.nrmse_before, worst.nrmse_parameters_only, worst.nrmse_after)
        stages = zip(("before", "parameters only", "after"), steps, strict=True)
        names, values = zip(*((n, v) for n, v in stages if v is not None), strict=True)
        shown = [plain(100 * value, 2) for value in values]
        role = "held out" if worst.role == "validation" else "fitted"
        found.append(
            KeyFigure(
                label=f"Error of the {draw.quantity(worst.signal)}, {role}",
                value=" → ".join(shown) + " %",
                note=f"{worst.file}: " + " → ".join(names),
            )
        )
    if page.effects:
        first = max(page.effects, key=lambda e: e.confidence)
        label = "Confidence" if first.confidence >= 0.5 else "Nearest known effect (not claimed)"
        found.append(
            KeyFigure(label=label, value=f"{100 * first.confidence:.0f} %", note=f"{first.name}")
        )
    if page.shares and page.subsystem in page.shares:
        share = page.shares[page.subsystem]
        found.append(
            KeyFigure(
                label="Share of the mismatch there",
                value=f"{100 * share:.0f} %",
                note=f"{page.subsystem}; without the part that parameters could explain",
            )
        )
    if page.remainder is not None:
        j = int(page.remainder.after.argmax())
        signal, after = page.remainder.signals[j], float(page.remainder.after[j])
        role = "held out" if any(c.role == "validation" for c in held) else "fitted"
        note = f"the noise floor, worst signal ({draw.quantity(signal)}), open loop; "
        slow = signal == "motor_angle_rad" and 2 < after < 100  # recordings.md: tens of counts
        note += (
            "tens are normal there: no drive repeats to one encoder count"
            if slow
            else "1 is the resolution of the sensors"
        )
        found.append(
            KeyFigure(label=f"Remaining error, {role}", value=f"{plain(after, 2)} ×", note=note)
        )
    return tuple(found)
