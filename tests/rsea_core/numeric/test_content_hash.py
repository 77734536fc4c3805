"""The key of a result follows from the content of its inputs: every bit of every array and file."""

from dataclasses import dataclass

import numpy as np
import pytest

from rsea_core.numeric.content_hash import content_hash


@dataclass(frozen=True)
class Held:
    values: np.ndarray
    name: str = "a"


def test_the_middle_of_a_long_array_counts():
    values = np.linspace(0.0, 1.0, 5000)
    other = values.copy()
    other[2500] = np.nextafter(other[2500], 2.0)
    assert content_hash(Held(values)) == content_hash(Held(values.copy()))
    assert content_hash(Held(values)) != content_hash(Held(other))


def test_the_content_of_a_file_counts_and_its_name_does_not(tmp_path):
    first, second = tmp_path / "a", tmp_path / "b"
    first.write_text("1,2")
    second.write_text("1,2")
    assert content_hash(first) == content_hash(second)
    second.write_text("1,3")
    assert content_hash(first) != content_hash(second)


@pytest.mark.parametrize(
    ("one", "other"),
    [((1, 2), ((1, 2),)), (1, 1.0), (("ab", "c"), ("a", "bc")), ({"a": 1}, {"b": 1}), ([], ())],
)
def test_what_differs_in_kind_or_order_differs(one, other):
    assert content_hash(one) != content_hash(other)
