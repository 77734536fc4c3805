"""Names, messages, comments and documents use the standard terms of the field."""

import re

import pytest

from tests.cases.words import AVOIDED, AVOIDED_IN_NAMES, avoided_in, named_with, with_any_avoided

# word (as in AVOIDED), files, what may stand there, reason
ALLOWED = (
    ("voids?", r".*", r"VOIDS|^voids$", "the name of the DXF layer"),
    ("voids?", r"docs/(conventions\.md|spring_terms\.py)", "", "where the term is defined"),
    ("voids?", r"tests/dftfs/cli/test_deploy_ros2\.py", "", "a type of C++"),
    ("voids?", r".*processes\.toml", "", "a hole of a part in manufacturing"),
    (
        "voids?",
        r".*",
        r"c_void_p|^void$|VOID$|void rsea_start|main\(void\)|\(void\)\w+;",
        "of C and of HTML",
    ),
    (
        "remainders?",
        r".*",
        r"[\"`.#]remainder|^_?remainder(_figure)?$|^(Remainder|REMAINDER)$",
        "key, file and section of diagnosis.json",
    ),
    ("remainders?", r".*diagnosis\.html", "remainder is not none", "that key"),
    ("remainders?", r".*making\.py", "largest remainders", "a method of apportionment"),
    (
        "(?<!supply.)sags?|sagging",
        r".*",
        r'"sag|/sag"|: sag[;,]|; sag[;,]|\| sag,|sag, no',
        "names of variants in the file contract",
    ),
    ("polish(ed|es|ing)?", r".*", r"^polish$", "an argument of scipy's differential evolution"),
    ("polish(ed|es|ing)?", r".*fkm\.py", r"polished", "a surface finish"),
    ("polish(ed|es|ing)?", r"docs/commands\.md", r".*polished.*", "a surface finish"),
    ("judging", r"dftfs/(proof/.*|cli/prove\.py)", "", "judges diagnoses, not controllers"),
)


# word (as in AVOIDED_IN_NAMES), files, names, reason
ALLOWED_NAMES = (
    ("quick", r".*", r"quick|QUICK(_\w+)?|MOST_STEPS_QUICK", "the option --quick"),
    ("words", r".*/(page|diagnosis_page)\.py", "words", "key of diagnosis.json and of page data"),
    ("words", r"tests/.*", "words", "of a text: the module that splits names into them"),
    ("hidden", r"(dftfs/proof|benchmarks)/.*", r"(?i)hidden(_errors)?", "a folder of proof sets"),
    (
        "outcome",
        r"(dftfs/proof|benchmarks|tests/dftfs/proof)/.*",
        r"(?i)outcome",
        "outcome.json of a proof run",
    ),
    ("rebound", r".*", "rebound", "key of model.toml: coefficient of restitution of backlash"),
    ("scales", r".*", "time_scales", "the standard term"),
    ("bend", r"(tests/)?dftfs/(fem|spring)/.*", r"\w+", "bending of rods; a published benchmark"),
    ("bent", r"(tests/)?dftfs/(fem|spring)/.*", r"\w+", "rods and bars under bending"),
    ("memory", r".*", "_?memory", "of the computer: who owns an array"),
)


def allowed(word: str, place: str, found: str) -> bool:
    return any(
        word == own and re.fullmatch(files, place) and re.search(what, found)
        for own, files, what, _ in ALLOWED
    )


@pytest.mark.parametrize("word", AVOIDED)
def test_no_word_of_the_left_column_is_used(word):
    used = [
        f"{place}: {found}"
        for place, (names, texts) in with_any_avoided().items()
        for found in avoided_in(names, texts, word)
        if not allowed(word, place, found)
    ]
    assert not used, f"write: {AVOIDED[word]}\n" + "\n".join(used)


def test_every_exception_is_needed():
    for word, files, what, reason in ALLOWED:
        assert reason
        assert any(
            re.fullmatch(files, place) and re.search(what, found)
            for place, (names, texts) in with_any_avoided().items()
            for found in avoided_in(names, texts, word)
        ), (word, files)


@pytest.mark.parametrize("word", AVOIDED_IN_NAMES)
def test_no_name_holds_a_word_that_has_a_standard_term(word):
    used = [
        f"{place}: {name}"
        for place, name in named_with(word)
        if not any(
            word == own and re.fullmatch(files, place) and re.fullmatch(what, name)
            for own, files, what, _ in ALLOWED_NAMES
        )
    ]
    assert not used, f"write: {AVOIDED_IN_NAMES[word]}\n" + "\n".join(used)


def test_every_exception_of_names_is_needed():
    for word, files, what, reason in ALLOWED_NAMES:
        assert reason
        assert any(
            re.fullmatch(files, place) and re.fullmatch(what, name)
            for place, name in named_with(word)
        ), (word, files)
