"""Controllers side by side as one self-contained HTML page."""

from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path

import numpy as np

from dftfs.report.control.comparison_tables import (
    disturbed_table,
    figures_table,
    moved_text,
    reasons_table,
    values_table,
)
from dftfs.report.control.loops import DASH, margins_table, spectra_figure, study_figures
from dftfs.report.live import Curve, Panel, with_live
from dftfs.report.numbers import readable
from dftfs.report.page import page_environment, render_page
from dftfs.report.page_data import write_page
from dftfs.report.provenance import provenance
from dftfs.report.study.render import symbols
from dftfs.report.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    SKY,
    VERMILION,
    ReportFigure,
    as_svg,
    house_style,
    new_figure,
)

COLOURS = (BLUE, VERMILION, GREEN, ORANGE, SKY, INK, GREY)
DASHES = ("-", "--", "-.", ":")
POINTS = 900


def write_comparison(
    comparison,
    verdicts: Sequence,
    path: Path,
    order: Sequence = (),
    inputs: Sequence[Path] = (),
    studies: Sequence = (),
    front: Sequence[str] = (),
) -> Path:
    """Write the page of a comparison whole or not at all.

    ``comparison`` and ``verdicts`` are those of `rsea_core.control.tuning.comparison`; ``inputs``
    are the files whose hashes the page states; the others are those of `render_comparison`.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    return write_page(
        path,
        "comparison",
        comparison=comparison,
        verdicts=list(verdicts),
        order=order,
        facts=provenance(inputs),
        studies=studies,
        front=front,
    )


def render_comparison(
    comparison,
    verdicts: Sequence,
    order: Sequence = (),
    facts: Sequence[tuple[str, str]] = (),
    studies: Sequence = (),
    front: Sequence[str] = (),
) -> str:
    """The page's HTML; `order` are the paired comparisons of neighbours in rank.

    ``studies`` are the `loop_study` of each controller, ``front`` the names on the Pareto front.
    """
    environment = page_environment(symbols=symbols)
    tuned = [v for v in verdicts if v.starts is not None]
    figures = {
        "following": _following(comparison, verdicts),
        "robustness": _robustness(comparison, verdicts),
        "tuning": _tuning(tuned) if tuned else None,
    }
    loops = study_figures(studies, _style)
    figures["spectra"] = spectra_figure(comparison, verdicts, _style, front)
    return render_page(
        environment,
        "comparison.html",
        [*figures.values(), *loops.values()],
        name=comparison.name,
        facts=facts,
        sentence=_sentence(comparison, verdicts),
        figures=figures,
        loops=list(loops.values()),
        margins_table=margins_table(studies),
        order=[_pair(pair, comparison) for pair in order],
        reasons_table=reasons_table(verdicts),
        figures_table=figures_table(comparison, verdicts),
        disturbed_table=disturbed_table(comparison, verdicts),
        values_table=values_table(verdicts),
        tuning_sentence=_tuning_sentence(comparison, tuned) if tuned else "",
        conditions=_conditions(comparison),
    )


def _unit(comparison) -> str:
    return comparison.task.reference.unit


def _style(j: int) -> dict:
    return {"color": COLOURS[j % len(COLOURS)], "linestyle": DASHES[j % len(DASHES)]}


def _thin(values):
    return values[:: max(len(values) // POINTS, 1)]


def _following(comparison, verdicts: Sequence) -> ReportFigure:
    unit = _unit(comparison)
    column = "torque_Nm" if unit == "Nm" else "load_angle_rad"
    with house_style():
        figure = new_figure(5.4)
        response, error, command = figure.subplots(3, 1, sharex=True, height_ratios=[1.4, 1.2, 1])
        first = verdicts[0].trajectory
        wanted = comparison.task.reference.sample(first.time_s)[:, 0]
        response.plot(
            _thin(first.time_s), _thin(wanted), color=GREY, lw=3, alpha=0.5, label="reference"
        )
        for j, verdict in enumerate(verdicts):
            run = verdict.trajectory
            goal = comparison.task.reference.sample(run.time_s)[:, 0]
            t, y = run.time_s, getattr(run, column)
            response.plot(_thin(t), _thin(y), lw=1.0, label=verdict.name, **_style(j))
            error.plot(_thin(t), _thin(goal - y), lw=0.9, **_style(j))
            command.plot(_thin(t), _thin(run.command), lw=0.9, **_style(j))
        judged = first.time_s >= comparison.task.from_s
        largest = max(
            np.abs(
                (comparison.task.reference.sample(v.trajectory.time_s)[:, 0]
                 - getattr(v.trajectory, column))[v.trajectory.time_s >= comparison.task.from_s]
            ).max()
            for v in verdicts
        )  # fmt: skip
        if judged.any() and largest > 0.0:
            error.set_ylim(-1.15 * largest, 1.15 * largest)
        response.set_ylabel(f"{'torque' if unit == 'Nm' else 'angle'} ({unit})")
        error.set_ylabel(f"error ({unit})")
        command.set_ylabel(first.command_name)
        command.set_xlabel("time (s)")
        figure.legend(loc="outside upper center", ncols=3)
        drawn = as_svg(
            figure,
            name="following",
            alt="Response, error and command of every controller against time.",
            caption="Response, error (scaled to the judged time) and command against time.",
        )
    return _live_following(drawn, comparison, verdicts, column)


def _live_following(drawn: ReportFigure, comparison, verdicts: Sequence, column: str):
    """The tracking figure to zoom into, where all runs have the same rows."""
    time, unit = verdicts[0].trajectory.time_s, _unit(comparison)
    if any(not np.array_equal(v.trajectory.time_s, time) for v in verdicts):
        return drawn
    goal = comparison.task.reference.sample(time)[:, 0]
    looks = [(_style(j)["color"], DASH[_style(j)["linestyle"]]) for j in range(len(verdicts))]

    def curves(of, in_legend: bool = False) -> tuple[Curve, ...]:
        return tuple(
            Curve(name=v.name, values=of(v.trajectory), colour=c, dash=d, in_legend=in_legend)
            for v, (c, d) in zip(verdicts, looks, strict=True)
        )

    reference = Curve(name="reference", values=goal, colour=GREY, width=3.0)
    what = "torque" if unit == "Nm" else "angle"
    panels = (
        Panel(
            label=f"{what} ({unit})",
            curves=(reference, *curves(lambda run: getattr(run, column), in_legend=True)),
            height=1.4,
        ),
        Panel(label=f"error ({unit})", curves=curves(lambda run: goal - getattr(run, column))),
        Panel(
            label=readable(verdicts[0].trajectory.command_name)[0],
            curves=curves(lambda run: run.command),
        ),
    )
    start = comparison.task.from_s
    return with_live(drawn, time, panels, shaded_to=start if start > 0 else None)


def _robustness(comparison, verdicts: Sequence) -> ReportFigure:
    unit, names = _unit(comparison), [v.name for v in verdicts]
    with house_style():
        figure = new_figure(0.9 + 0.42 * len(names))
        axes = figure.subplots()
        for j, verdict in enumerate(verdicts):
            spread = verdict.robustness.monte_carlo_rmse
            spread = spread[np.isfinite(spread)]
            axes.plot(spread, np.full(spread.size, j), "|", color=GREY, ms=9, alpha=0.8)
            axes.plot(verdict.following.rmse, j, "o", color=BLUE, ms=6)
            wrong = verdict.robustness.wrong_compensator_rmse
            if wrong is not None:
                axes.plot(wrong, j, "D", color=VERMILION, ms=5)
        axes.plot([], [], "o", color=BLUE, label="nominal")
        axes.plot([], [], "|", color=GREY, ms=9, label="random machines")
        axes.plot([], [], "D", color=VERMILION, label="compensator 30 % wrong")
        axes.set_yticks(range(len(names)), names)
        axes.invert_yaxis()
        axes.set_xlim(left=0.0)
        axes.set_xlabel(f"RMSE ({unit})")
        figure.legend(loc="outside upper center", ncols=3)
    return as_svg(
        figure,
        name="robustness",
        alt="RMSE of every controller on the nominal and on random machines.",
        caption="RMSE on the machine that it was tuned on, on machines with other values and noise,"
        " and with a friction compensator that is 30 % off in the worse direction.",
    )


def _tuning(verdicts: Sequence) -> ReportFigure:
    with house_style():
        figure = new_figure(2.9)
        axes = figure.subplots()
        for j, verdict in enumerate(verdicts):
            for n, search in enumerate(verdict.starts.searches):
                axes.semilogy(
                    np.arange(1, search.history.size + 1),
                    search.history,
                    lw=0.9,
                    label=verdict.name if n == 0 else None,
                    **_style(j),
                )
        axes.set_xlabel("generation")
        axes.set_ylabel("lowest cost")
        axes.legend(loc="upper right")
    return as_svg(
        figure,
        name="tuning",
        alt="Lowest cost against generation, one line for each seed.",
        caption="Lowest cost found against generation, one line for each seed.",
    )


def _sentence(comparison, verdicts: Sequence) -> str:
    order = sorted((v for v in verdicts if not v.reasons), key=lambda v: v.expected_rmse)
    unit = _unit(comparison)
    text = ", ".join(f"{v.name} {v.expected_rmse:.4g}" for v in order)
    if not order:
        return f"No loop of {len(verdicts)} may be ranked; the reasons are below."
    over = f", mean over {comparison.perturbed} random machines" if comparison.perturbed else ""
    return f"RMSE in {unit}{over}, best first of {len(order)} ranked loops: {text}."


def _tuning_sentence(comparison, tuned: Sequence) -> str:
    failed = ", ".join(f"{v.name} {v.starts.failed_share:.0%}" for v in tuned)
    ranked = ", ".join(f"{v.name} {v.seeds_ranked}" for v in tuned)
    return (
        f"{comparison.method}, {len(comparison.seeds)} seeds, {comparison.population} runs a"
        f" generation, {comparison.generations} generations: {tuned[0].starts.evaluations}"
        " evaluations for each controller, bounds grown on the way. Seeds that ended"
        f" beyond twice the lowest cost: {failed}. Seeds with a point that may be ranked, whose"
        f" mean is the expected RMSE: {ranked}."
    )


def _pair(pair, comparison) -> str:
    low, high = pair.difference
    return (
        f"{pair.better} before {pair.worse}: probability {pair.probability:.3f}, difference"
        f" {low:.3g} to {high:.3g} {_unit(comparison)} (95 %)"
    )


def _reference(reference) -> str:
    """A reference in words: its kind and the values that it has."""
    given = [(f.name, getattr(reference, f.name)) for f in fields(reference) if f.name != "kind"]
    values = [(*readable(name), v) for name, v in given if v is not None]
    shown = [f"{label} {v if isinstance(v, str) else f'{v:g}'} {unit}" for label, unit, v in values]
    return ", ".join([reference.kind, *(text.strip() for text in shown)])


def _conditions(comparison) -> list[str]:
    task = comparison.task
    terms = ", ".join(term.effect for term in task.model.terms) or "none"
    motor, load, current = task.noise
    return [
        f"Rig {task.model.rig.name}; loads: {', '.join(load.kind for load in task.loads)}; effects"
        f" beyond the nominal equations: {terms}.",
        f"Reference: {_reference(task.reference)}.",
        f"Cost {task.cost}, {task.duration_s:g} s judged from {task.from_s:g} s; noise while tuning"
        f" {motor:g} rad (motor), {load:g} rad (load), {current:g} A; the rig's encoders.",
        f"{comparison.perturbed} random machines, each with its own noise; controllers stay"
        " designed for the nominal one. They differ in (standard deviations)"
        f" {moved_text(comparison.moved)}.",
        *_about_distance(task.least_modulus_margin),
        *_about_disturbances(comparison),
    ]


def _about_distance(least: float) -> list[str]:
    if least == 0.0:
        return []
    return [
        f"Every loop must keep a distance of {least:g} from -1: linear loops and fuzzy tables at"
        " rest, fuzzy tables by their describing function, too, from three counts of the encoder"
        " that moves up to the task's amplitude."
    ]


def _about_disturbances(comparison) -> list[str]:
    if not comparison.disturbances:
        return []
    if comparison.task.loads[0].is_held:
        return ["The output is locked, so external torques cannot move it: disturbances left out."]
    first = comparison.disturbances[0]
    names = ", ".join(d.name for d in comparison.disturbances)
    return [f"Disturbances {names}, from {first.start_s:g} s to {first.end_s:g} s."]
