"""Which laws a search of whole recordings tries, and which are forms of one another."""

from collections.abc import Sequence

from rsea_core.effects.variant import Law
from rsea_core.identify.law_search.candidate_fits import count_values
from rsea_core.identify.law_search.screening import Candidate
from rsea_core.identify.multistep.criteria import WHOLE_FORMS, WHOLE_TRIED


def most_promising(screened: Sequence[Candidate]) -> list[Candidate]:
    """Of each effect and reading the best laws and the one with the fewest values."""
    forms: dict[tuple, list[Candidate]] = {}
    for c in sorted((c for c in screened if c.gain > 0.0), key=lambda c: -c.gain):
        forms.setdefault((c.law.effect, c.law.sensor), []).append(c)
    found = []
    for laws in forms.values():
        plain = min(laws, key=lambda c: count_values(c.law))
        found += laws[:WHOLE_FORMS] + ([] if plain in laws[:WHOLE_FORMS] else [plain])
    return found[:WHOLE_TRIED]


def of_other_effects(screened: Sequence[Candidate], tried: Sequence[Candidate]) -> list[Candidate]:
    """The best candidate of each effect and reading that is not tried.

    A screening about parameters that are far off does not show what these have taken up.
    """
    have = {(c.law.effect, c.law.sensor) for c in tried}
    best: dict[tuple, Candidate] = {}
    for c in sorted(screened, key=lambda c: -c.gain):
        best.setdefault((c.law.effect, c.law.sensor), c)
    return [c for group, c in best.items() if group not in have]


def holds(law: Law, plainer: Law) -> bool:
    """Whether a law has all values of another one of its effect and reading, or more."""
    names, fewer = ({p.name for p in w.unknowns} for w in (law, plainer))
    same = (law.effect, law.sensor) == (plainer.effect, plainer.sensor)
    same = same and law.key != plainer.key
    return same and fewer <= names and plainer.fixed_numbers.items() <= law.fixed_numbers.items()


def richer_of(law: Law, laws: Sequence[Law]) -> list[Law]:
    """Laws that are tried only in place of one with a number that no fit changes."""
    forms = [w for w in laws if w.follows and w.law in law.richer and holds(w, law)]
    return forms if law.fixed_numbers else []


def alike(law: Law, laws: Sequence[Law]) -> list[Law]:
    """Laws that differ from one in a number that no fit changes, the nearest first."""
    fixed, found = law.fixed_numbers, []
    for other in laws:
        numbers = other.fixed_numbers
        names = [p.name for p in other.unknowns] == [p.name for p in law.unknowns]
        same = (other.effect, other.sensor) == (law.effect, law.sensor) and names
        if fixed and same and numbers != fixed and numbers.keys() == fixed.keys():
            found.append((sum(abs(numbers[name] - fixed[name]) for name in fixed), other))
    return [other for _, other in sorted(found, key=lambda f: f[0])]
