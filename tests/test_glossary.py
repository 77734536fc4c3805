"""Names, messages, comments and documents use the standard terms of the field."""

import re

import pytest

from tests.cases.sources import exceptions
from tests.cases.words import AVOIDED, COUNTED, avoided_in, contents, counted

# word (as in AVOIDED), files, what may stand there, reason
ALLOWED = (
    ("voids?", r".*", r"VOIDS|^voids$", "the name of the DXF layer"),
    ("voids?", r"docs/(conventions\.md|spring_terms\.py)", "", "where the term is defined"),
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
    ("remainders?", r".*diagnose_routes\.py", "remainder : columns", "that key"),
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


def allowed(word: str, place: str, found: str) -> bool:
    return any(
        word == own and re.fullmatch(files, place) and re.search(what, found)
        for own, files, what, _ in ALLOWED
    )


@pytest.mark.parametrize("word", AVOIDED)
def test_no_word_of_the_left_column_is_used(word):
    used = [
        f"{place}: {found}"
        for place, (names, texts) in contents().items()
        for found in avoided_in(names, texts, word)
        if not allowed(word, place, found)
    ]
    assert not used, f"write: {AVOIDED[word]}\n" + "\n".join(used)


def test_every_exception_is_needed():
    for word, files, what, reason in ALLOWED:
        assert reason
        assert any(
            re.fullmatch(files, place) and re.search(what, found)
            for place, (names, texts) in contents().items()
            for found in avoided_in(names, texts, word)
        ), (word, files)


def test_names_with_words_that_have_a_standard_term_become_fewer():
    listed, now = exceptions()["words"], counted()
    assert listed.keys() <= COUNTED.keys()
    more = {word: n for word, n in now.items() if n > listed.get(word, 0)}
    assert not more, f"new names with these words; write {[COUNTED[word] for word in more]}"
    assert not [word for word in listed if not now[word]], "take these out of the list"
