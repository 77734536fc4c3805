"""Six answers make a sizing task, or the design that the search finds for it."""

import re
from importlib import resources

from dftfs.analysis.sizing.task import load_task
from dftfs.errors import DftfsError
from rsea_core.files.toml_tables import toml_string

QUESTIONS = {
    "stiffness_Nm_per_rad": "stiffness, Nm/rad",
    "contact_free_torque_Nm": "torque in either direction before coils touch, Nm",
    "envelope_mm": "largest outside diameter, mm",
    "min_bore_mm": "smallest bore, mm",
    "material": "material (`dftfs materials` lists them)",
    "process": "process: wire-edm, water-jet, laser, milling, print-metal, print-polymer",
}
TEXT_FIELDS = ("material", "process")


def asked(kind: str) -> dict[str, str]:
    """An answer to each question, read line by line; an empty one keeps the default.

    Raises
    ------
    DftfsError
        If the kind has no questions, or the answers end early.
    """
    if kind not in ("task", "design"):
        raise DftfsError(f"--ask is for task and design, e.g. dftfs new task mine.toml, not {kind}")
    text, answers = _default(), {}
    for field, question in QUESTIONS.items():
        kept = re.search(rf"(?m)^{field} = \"?([^\"\n]*)\"?$", text).group(1)
        try:
            answers[field] = input(f"{question} [{kept}]: ").strip() or kept
        except EOFError:
            raise DftfsError(f"six answers are needed; the input ended at: {question}") from None
    return answers


def filled(kind: str, name: str, answers: dict[str, str]) -> str:
    """The file's text.

    A design is the lightest that the rod model finds.

    Raises
    ------
    DesignError
        If an answer cannot be used.
    DftfsError
        If no design meets the answers: the task says which requirement is in the way.
    """
    task = load_task("default", answers)  # refused before anything is written
    if kind == "task":
        text = _default()
        for field, value in answers.items():
            new = toml_string(value) if field in TEXT_FIELDS else f"{float(value)!r}"
            text = re.sub(rf"(?m)^{field} = .*$", lambda _, n=new, f=field: f"{f} = {n}", text)
        return f"# Made by `dftfs new task --ask`; every value is one to change.\n{text}"
    from dftfs.analysis.sizing.fe_confirmation import as_design
    from dftfs.analysis.sizing.search import Sizing, size
    from dftfs.design import design_toml

    found = size(task)
    if not isinstance(found, Sizing):
        raise DftfsError(
            f"no spring meets these answers: {found.best.why} is in the way; `dftfs new task"
            f" {name}.toml --ask`, then `dftfs size {name}.toml`, reports how far each has to"
            " change"
        )
    lines = [f"# {question}: {answers[field]}" for field, question in QUESTIONS.items()]
    head = ["# Made by `dftfs new design --ask`: the lightest by the rod model for", *lines]
    return "\n".join([*head, design_toml(as_design(task, found.best, name))])


def _default() -> str:
    return resources.files("dftfs").joinpath("data/sizing/default.toml").read_text(encoding="utf-8")
