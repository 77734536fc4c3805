"""A search that is not complete begins again with a law that alone explains nearly as much.

A parallel spring and an eccentric mass explain nearly the same of a small motion; with the wrong
one of the two, no friction law fits.
"""

from types import SimpleNamespace

import pytest

from rsea_core.identify.law_search.screening import Candidate
from rsea_core.identify.whole_runs.search import WholeSearch, begun_with_rival
from rsea_core.identify.whole_runs.taken_laws import Trial


def law(effect: str, only: str | None = None) -> SimpleNamespace:
    return SimpleNamespace(effect=effect, sensor=None, key=effect, only=only)


MASS, SPRING, FRICTION = law("load-unbalance"), law("spring-parallel"), law("gear-load-friction")
PULSE = law("load-disturbance", only="rec1.csv")


class KnownMisfits(WholeSearch):
    """A search whose misfits are known, and which takes friction as its second law."""

    def left(self) -> float:
        return 1.0 if {SPRING.effect, FRICTION.effect} <= {w.effect for w in self.taken} else 4.0

    def to_minimum(self, trial):
        return trial.fit

    def take(self, best, fit, trials, say) -> None:
        assert best in trials
        self.taken.append(best.law)

    def add_all(self, say) -> None:
        self.taken.append(FRICTION)


def trial(of, gain: float) -> Trial:
    candidate = Candidate(law=of, start=(), gain=gain, held_out=gain, deviation=1.0, size=1.0)
    return Trial(candidate=candidate, fit=None, gain=gain, left=4.0)


def searched(*trials: Trial) -> KnownMisfits:
    """A search that took the first of these, and friction, and is not complete."""
    search = KnownMisfits(None, None, None, (), enough=1.6)
    search.first = list(trials)
    search.taken = [trials[0].law, FRICTION]
    return search


def test_a_rival_that_completes_the_search_takes_the_place_of_the_first_law():
    lines = []
    search = searched(trial(MASS, 100.0), trial(SPRING, 98.0))
    other = begun_with_rival(search, lines.append)
    assert other.taken == [SPRING, FRICTION]
    assert len(lines) == 1


@pytest.mark.parametrize(
    ("others", "tried"),
    [
        ((trial(SPRING, 80.0),), 0),  # explains less alone
        ((trial(law("load-drag"), 99.0),), 1),  # completes nothing
        ((trial(PULSE, 99.0),), 0),  # acts once
        ((), 0),
    ],
)
def test_the_search_is_kept_if_no_close_lasting_rival_completes_it(others, tried):
    lines = []
    assert begun_with_rival(searched(trial(MASS, 100.0), *others), lines.append) is None
    assert len(lines) == tried


def test_a_complete_search_is_not_repeated():
    search = searched(trial(MASS, 100.0), trial(SPRING, 98.0))
    search.taken = [SPRING, FRICTION]
    assert begun_with_rival(search, print) is None
