"""A preset strip agrees with fibres that are loaded, let go and loaded again one by one."""

import numpy as np
import pytest

from dftfs.analysis.strength.presetting import presetting, section_moment
from dftfs.errors import DesignError

DEPTH = (np.arange(4000) + 0.5) / 4000  # of half a section, over its half height


class Fibres:
    """Half a section of fibres with kinematic hardening; stress over yield, strain likewise."""

    def __init__(self, slope):
        self.modulus = slope / (1.0 - slope)  # of the back stress, by plastic strain
        self.plastic = np.zeros(DEPTH.size)

    def moment_at(self, curvature):
        trial = curvature * DEPTH - self.plastic
        shifted = trial - self.modulus * self.plastic
        over = np.maximum(np.abs(shifted) - 1.0, 0.0)
        self.plastic = self.plastic + np.sign(shifted) * over / (1.0 + self.modulus)
        self.yielding = bool((over > 1e-9).any())
        self.stress = curvature * DEPTH - self.plastic
        return 3.0 * np.mean(self.stress * DEPTH)


@pytest.mark.parametrize("slope", [0.0, 0.05])
def test_residual_stress_set_and_both_elastic_limits_are_those_of_fibres(slope):
    found = presetting(1.3, slope)
    section = Fibres(slope)
    for share in np.linspace(0.0, 1.0, 50)[1:]:
        moment = section.moment_at(share * found.curvature)
    assert moment == pytest.approx(1.3, abs=1e-6)
    left = found.curvature - moment
    assert section.moment_at(left) == pytest.approx(0.0, abs=1e-6)
    assert left == pytest.approx(found.set_curvature, abs=1e-6)
    assert section.stress[-1] == pytest.approx(found.surface, abs=1e-3)
    assert section.moment_at(left + 0.999 * found.moment) == pytest.approx(0.999 * 1.3, abs=1e-5)
    assert not section.yielding
    section.moment_at(left - 0.995 * found.reverse_moment)
    assert not section.yielding
    section.moment_at(left - 1.01 * found.reverse_moment)
    assert section.yielding


def test_closed_forms_of_a_perfectly_plastic_strip():
    assert section_moment(2.0) == pytest.approx(1.5 - 0.5 / 4.0)
    assert section_moment(1.0, 0.3) == 1.0
    assert presetting(1.375).curvature == pytest.approx(2.0)
    assert presetting(1.375).surface == pytest.approx(-0.375)
    assert presetting(0.8).set_curvature == 0.0
    with pytest.raises(DesignError, match="collapses"):
        presetting(1.5)
    with pytest.raises(DesignError, match="above 0"):
        presetting(0.0)
