"""H7 is that of ISO 286-1, at the ends of its ranges too."""

import pytest

from dftfs.cad.fits import h7_m
from dftfs.errors import DesignError


@pytest.mark.parametrize(
    ("size_mm", "upper_um"),
    [(2.136, 10), (3, 10), (3.001, 12), (21.36, 21), (30, 21), (30.001, 25), (120, 35), (500, 63)],
)
def test_the_upper_deviation_is_that_of_the_standard(size_mm, upper_um):
    assert h7_m(1e-3 * size_mm) == pytest.approx(1e-6 * upper_um)


@pytest.mark.parametrize("size_mm", [0.0, -1.0, 3200.0, float("nan")])
def test_a_size_that_is_not_in_the_standard_is_refused(size_mm):
    with pytest.raises(DesignError, match="has no H7"):
        h7_m(1e-3 * size_mm)
