"""A diagnosis document (`diagnosis.json`) in lines of text."""

import textwrap
from collections.abc import Mapping

WIDTH = 100
MOST_FIGURES = 4  # of an effect
MOST_NOTES = 8


def headline(document: Mapping) -> str:
    """Verdict and summary."""
    return f"{document['verdict']}: {document['summary']}"


def notes(document: Mapping) -> list[str]:
    """Findings, and what to record next where the document asks for it, a line each."""
    lines = [f"note: {finding}" for finding in document["findings"]]
    if document["next_experiment"] is not None:
        lines.append(f"record next: {document['next_experiment']['sentence']}")
    return lines


def brief_text(document: Mapping) -> str:
    """Verdict, effects with confidence and figures, and notes, in a few lines."""
    lines = [headline(document), *(f"  {_effect(e)}" for e in document["effects"])]
    further = notes(document)
    lines += further[:MOST_NOTES]
    if len(further) > MOST_NOTES:
        lines.append(f'... and {len(further) - MOST_NOTES} more notes, in document["findings"]')
    wrapped = (
        textwrap.wrap(line, WIDTH, subsequent_indent="    ", break_on_hyphens=False)
        for line in lines
    )
    return "\n".join(row for rows in wrapped for row in rows)


def _effect(effect: Mapping) -> str:
    """One effect: name, place, confidence, figures, and what cannot be distinguished from it."""
    figures = list(effect["parameters"].items())
    shown = [_figure(name, entry) for name, entry in figures[:MOST_FIGURES]]
    shown += ["..."] if len(figures) > MOST_FIGURES else []
    text = f"{effect['name']} ({effect['subsystem']}), confidence {effect['confidence']:.2f}"
    text += f": {', '.join(shown)}" if shown else ""
    others = [name for name in effect["class"] if name != effect["name"]]
    return f"{text}; not distinguished from {', '.join(others)}" if others else text


def _figure(name: str, entry: Mapping) -> str:
    """A figure with its standard deviation; its unit ends its name."""
    value, std = entry["value"], entry.get("std")
    if not isinstance(value, float | int):
        return f"{name} = {value}"
    return f"{name} = {value:.4g}" + ("" if std is None else f" +- {std:.2g}")
