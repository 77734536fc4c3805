"""300 mutated inputs of each reader: read or refused in one line, no traceback, warning or hang.

`python -m benchmarks.fuzz` tries 100,000.
"""

import pytest

from benchmarks.fuzz import READERS, attack


@pytest.mark.parametrize("reader", READERS)
def test_a_mutated_input_is_read_or_refused_in_one_line(reader, tmp_path):
    counts, defects = attack(reader, 300, 0, tmp_path)
    assert not defects
    assert counts["read"] > 0
    assert counts["refused"] > 0
