"""The names and the text of the project, word by word, and the words that they avoid."""

import functools
import io
import re
import subprocess
import tokenize
from pathlib import Path

from tests.cases.places import ROOT

PLACES = ("rsea_core", "dftfs", "docs", "tests", "benchmarks", "README.md")
TEXTS = (".md", ".toml", ".html", ".txt")
OWN = ("tests/cases/words.py", "tests/test_glossary.py")

# what is not to be written anywhere: the standard term
AVOIDED = {
    "nats": "log-likelihood units",
    "knobs?": "unknown, free parameter",
    "drafts?": "trial machine",
    "(at|sent|came|moved) home|homewards?|homing": "at, reset to, restored to the prior mean",
    "astray": "far from its prior mean",
    "hopeless": "cannot reach the threshold",
    "came from elsewhere": "explained better by another port",
    "leaves a signal": "unmodelled input detected",
    "righted": "corrected for sensor errors",
    "thinn(ed|ing)": "decimated, decimation",
    "one factor": "common scale factor",
    "enriched": "with richer law",
    "null replays?": "parametric bootstrap under the null",
    "remainders?": "unexplained residual",
    "port responses?": "port sensitivity",
    "unsaid": "unstated",
    "excitation answers?": "rival response",
    "polish(ed|es|ing)?": "final refinement",
    "contradictions?": "consistency check, inconsistency",
    "row faults?": "sample fault",
    "dry moves?": "Coulomb step",
    "driven back": "backdriven, backdriving",
    "(?<!supply.)sags?|sagging": "supply sag",
    "heat of the past|left K": "initial temperatures, initial rises",
    "(fast|precise) engines?": "fixed-step engine, event-driven engine",
    "judging": "figures of merit",
    "entrants?": "controllers compared",
    "search logs?": "checkpoint",
    "fuzzy lint|lint": "rule-base checks",
    "contact walks?|first look": "contact continuation",
    "inside out": "inverted element",
    "voids?": "gap between the coils",
    "outside torques?": "external torque",
    "(link|beam)s? that bends?": "flexible link",
    "rub(s|bed|bing)?": "dry friction",
    "dragged": "drag, drawn",
    "teeth of the motor|beside zero|in another scale": "cogging, offset, scale error",
    "(do|does) not know it alone": "not identifiable from these recordings alone",
    "bound of what is allowed": "at its bound",
}

# what is not to be a word of a name: the standard term
AVOIDED_IN_NAMES = {
    "outcome": "diagnosis document",
    "said": "reported",
    "told": "reported",
    "words": "text, sentence",
    "way": "direction, sign",
    "ways": "directions",
    "bend": "deflection",
    "bent": "deflected",
    "stretch": "bristle deflection, element deflection",
    "push": "applied torque",
    "pull": "load torque",
    "play": "backlash",
    "rebound": "coefficient of restitution",
    "memory": "internal states",
    "switches": "events",
    "slopes": "Jacobian",
    "scales": "typical magnitudes",
    "waves": "periodic regressors",
    "beside": "jointly with",
    "quick": "closed-form",
    "bars": "thresholds",
    "hidden": "undetectable",
    "amounts": "minimum detectable size",
    "doubts": "data errors",
}


@functools.cache
@functools.cache
def words_of(name: str) -> str:
    """The words of a name in lower case: `toTheLeft_K` is "to the left k"."""
    return " ".join(re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", name)).lower()


def _tracked() -> list[str]:
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", *PLACES],
        cwd=ROOT, capture_output=True, text=True, check=True,
    ).stdout.splitlines()  # fmt: skip
    return sorted(f for f in listed if (ROOT / f).is_file() and f not in OWN)


def _of_python(path: Path) -> tuple[set[str], list[tuple[int, str]]]:
    names, texts = set(), []
    source = path.read_text(encoding="utf-8")
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.NAME:
            names.add(token.string)
        elif token.type in (tokenize.STRING, tokenize.COMMENT):
            texts.append((token.start[0], token.string))
    return names, texts


@functools.cache
def contents() -> dict[str, tuple[frozenset[str], tuple[tuple[int, str], ...]]]:
    """Of every file: its names, and its text by the line at which a piece of it begins."""
    found = {}
    for place in _tracked():
        path = ROOT / place
        if path.suffix == ".py":
            names, texts = _of_python(path)
        elif path.suffix in TEXTS:
            names, texts = set(), [(1, path.read_text(encoding="utf-8"))]
        else:
            continue
        found[place] = (frozenset(names), tuple(texts))
    return found


def _pattern(word: str) -> re.Pattern:
    return re.compile(rf"(?i)\b(?:{word})\b".replace(" ", r"[\s_]+"))


@functools.cache
def with_any_avoided() -> dict[str, tuple[frozenset[str], tuple[tuple[int, str], ...]]]:
    """`contents` of the files in which any word of `AVOIDED` stands."""
    anything = _pattern("|".join(AVOIDED))
    return {
        place: (names, texts)
        for place, (names, texts) in contents().items()
        if any(anything.search(text) for _, text in texts)
        or any(anything.search(words_of(name)) for name in names)
    }


def avoided_in(names: frozenset[str], texts, word: str) -> list[str]:
    """The names with a word, and the pieces of text (`line: ... word ...`)."""
    pattern = _pattern(word)
    found = [name for name in sorted(names) if pattern.search(words_of(name))]
    for line, text in texts:
        for hit in pattern.finditer(text):
            around = text[max(0, hit.start() - 30) : hit.end() + 30]
            at = line + text.count("\n", 0, hit.start())
            found.append(f"{at}: {' '.join(around.split())}")
    return found


def named_with(word: str) -> list[tuple[str, str]]:
    """Every (file, name) of which a word is a part."""
    return [
        (place, name)
        for place, (names, _) in contents().items()
        for name in sorted(names)
        if word in words_of(name).split()
    ]
