"""From a finished run to its figures: the seal first, then scores, then the summary."""

import json
from dataclasses import dataclass
from pathlib import Path

from dftfs.proof.labels import LABELS, check_seal
from dftfs.proof.running import OUTCOME, RUN, RunError, is_finished
from dftfs.proof.scoring import SMALLEST_GAP, Score, score_case
from dftfs.proof.summary import Rate, Summary, summarise
from dftfs.proof.writing import HIDDEN

BASELINES = "baselines"


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """The figures of one run and what they were made from."""

    seal: str
    commands: list[str]
    scores: list[Score]
    summary: Summary
    errors: dict[str, list[float]]
    wins: dict[str, Rate | None]


def read_json(path: Path) -> dict | None:
    """A JSON document; None where there is no file."""
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else None


def sealed_run(folder: Path, name: str) -> tuple[str, dict]:
    """The seal of a set, and the order of a run that was made under it.

    Raises
    ------
    SealError
        If the labels are not the ones that were sealed.
    RunError
        If there is no such run, or it was made under another seal.
    """
    seal = check_seal(folder)
    place = folder / "runs" / name
    order = read_json(place / RUN)
    if order is None:
        raise RunError(f"{place}: no run; `dftfs prove run` makes it")
    if order["seal"] != seal:
        raise RunError(f"{place}: the run was made under another seal ({order['seal'][:12]}...)")
    return seal, order


def judge(folder: Path, name: str = "diagnosis") -> Judgement:
    """Check the seal and score a run; cases that were not run count as without a diagnosis.

    A case whose process was killed does not count; `dftfs prove run` runs it again.

    Raises
    ------
    SealError
        If the labels are not the ones that were sealed.
    RunError
        If there is no such run, or it was made under another seal.
    """
    seal, order = sealed_run(folder, name)
    place = folder / "runs" / name
    labels = json.loads((folder / LABELS).read_text(encoding="utf-8"))
    scores = []
    for case, label in labels.items():
        if (place / case).is_dir() and not is_finished(place / case):
            continue  # its process was killed: no verdict of the diagnosis
        outcome = read_json(place / case / OUTCOME) or {}
        scores.append(
            score_case(
                case,
                label,
                read_json(place / case / "diagnosis.json"),
                folder / HIDDEN / case,
                place / case / "prediction.csv",
                outcome.get("diagnose_s"),
            )
        )
    boxes = {case: read_json(folder / BASELINES / f"{case}.json") or {} for case in labels}
    errors, wins = held_out(scores, boxes)
    return Judgement(
        seal=seal,
        commands=order["commands"],
        scores=scores,
        summary=summarise(scores),
        errors=errors,
        wins=wins,
    )


def held_out(
    scores: list[Score], boxes: dict[str, dict]
) -> tuple[dict[str, list[float]], dict[str, Rate | None]]:
    """Hidden-test error over the floor per method, and how often the diagnosis is as good.

    Channels count where an effect is there and the refit of the constants leaves a gap.
    """
    errors: dict[str, list[float]] = {}
    better: dict[str, list[float]] = {}
    for score in scores:
        if score.level in ("null", "poor"):
            continue
        for channel, row in score.channels.items():
            if row["refit"] - row["floor"] <= max(SMALLEST_GAP, 0.5 * row["floor"]):
                continue
            values = {k: row[k] for k in ("nominal", "refit", "predicted") if k in row}
            for method, by_channel in boxes.get(score.case, {}).items():
                if channel in by_channel:
                    values[method] = by_channel[channel]
            for method, value in values.items():
                errors.setdefault(method, []).append(value / row["floor"])
                if method != "predicted" and "predicted" in values:
                    better.setdefault(method, []).append(
                        float(values["predicted"] <= value + SMALLEST_GAP)
                    )
    return errors, {m: Rate.of(v) for m, v in better.items()}
