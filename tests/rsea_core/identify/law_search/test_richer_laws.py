"""Richer laws: nested ones are never fitted worse, and those of near rivals are tried."""

from types import SimpleNamespace

import pytest

from rsea_core.effects.load_drag import LoadDrag
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search import richer_laws
from rsea_core.identify.law_search.candidate_fits import fitted, settled
from rsea_core.identify.law_search.screening import Candidate
from rsea_core.identify.multistep.criteria import PER_VALUE
from rsea_core.identify.multistep.log_nuisances import nuisances
from rsea_core.identify.multistep.timing_choice import parameters_with_timing
from tests.cases.one_axis import pendulum_case


def test_a_law_that_holds_another_is_fitted_no_worse(tmp_path):
    case = pendulum_case(tmp_path, LoadDrag(torque_at_5_rad_per_s_Nm=0.02), seed=3)
    h = Hypothesis(laws=nuisances(case))
    estimator, base, _ = parameters_with_timing(case, h, lambda text: None)
    laws = catalogue(case, relative=True)
    plain = laws["load-drag/quadratic"]
    candidate = Candidate(law=plain, start=plain.starts[0], size=1.0, gain=1.0, held_out=1.0,
                          deviation=1.0)  # fmt: skip
    own, fit = settled(estimator, fitted(estimator, base, candidate), once=True)
    lines = []
    richer_laws.with_richer_law((candidate, own, fit), base, list(laws.values()), lines.append)
    worth = {line.split()[1].rstrip(":"): float(line.split()[-1]) for line in lines}
    assert worth["load-drag/power"] > -PER_VALUE - 1.0


def test_the_richer_law_of_a_rival_near_the_best_one_takes_its_place(monkeypatch):
    near, far, best = (SimpleNamespace(law=SimpleNamespace(key=k)) for k in ("near", "far", "best"))
    tried = []

    def richer(entry, *_):
        tried.append(entry[0].law.key)
        return (*entry[:2], entry[2] + 100.0) if entry[0] is near else entry

    monkeypatch.setattr(richer_laws, "with_richer_law", richer)
    monkeypatch.setattr(
        richer_laws, "preferred", lambda found, worth: sorted(found, key=worth)[::-1]
    )
    entries = [(best, None, 50.0), (near, None, 45.0), (far, None, 20.0)]
    found, known = richer_laws.with_richer_rivals(entries, None, (), lambda e: e[2], print)
    assert [e[0].law.key for e in found] == ["near", "best", "far"]
    assert tried == ["best", "near"]
    assert known == {"best", "near"}


@pytest.mark.parametrize(("gain", "named"), [(98.0, "sensor-offset"), (50.0, "transmission")])
def test_an_offset_that_explains_as_much_is_named_before_a_transmission_error(gain, named):
    def entry(effect, subsystem, values):
        unknowns = [SimpleNamespace(scale=1.0)] * values
        law = SimpleNamespace(effect=effect, subsystem=subsystem, unknowns=unknowns)
        return (SimpleNamespace(law=law),)

    error = entry("gear-transmission-error", "gear", 3)
    offset = entry("sensor-offset", "sensor:torque_Nm", 1)
    worth = {id(error): 100.0, id(offset): gain}
    found = richer_laws.prefer_plainer([error, offset], lambda e: worth[id(e)])
    assert found == ([offset] if named == "sensor-offset" else [error, offset])
