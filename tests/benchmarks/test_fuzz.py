"""300 mutated inputs of each reader: read or refused in one line, no traceback, warning or hang.

`python -m benchmarks.fuzz` tries 100,000.
"""

import re

import pytest

from benchmarks.fuzz import READERS, attack, reader_seeds
from dftfs.cli.endings import one_line
from dftfs.errors import DftfsError
from rsea_core.errors import RseaError


@pytest.mark.parametrize("reader", READERS)
def test_a_mutated_input_is_read_or_refused_in_one_line(reader, tmp_path):
    counts, defects = attack(reader, 300, 0, tmp_path)
    assert not defects
    assert counts["read"] > 0
    assert counts["refused"] > 0


SPRING = "deflection_rad,torque_Nm\n-1e200,-1\n0,0\n0.1,1\n"
FILE = reader_seeds()["rig"][0] + f'[[recording]]\nfile = "{"A" * 5000}"\nload = "locked"\n'
TASK, RANGES = reader_seeds()["task"]


@pytest.mark.parametrize(
    ("reader", "text"),
    [
        ("curve", SPRING),
        ("curve", SPRING.replace("-1e200", "-5e-324")),
        ("case", FILE),
        ("task", re.sub(r"(?m)^(envelope_mm = )[\d.]+", r"\g<1>5e-324", TASK)),
        ("task", re.sub(r"(?m)^(\w+_mm = \[.*), [\d.]+\]", r"\1, 5e-324]", RANGES)),
    ],
)
def test_what_the_100000_inputs_found_is_refused_in_one_line(reader, text, tmp_path):
    path = tmp_path / "input"
    path.write_text(text, encoding="utf-8")
    with pytest.raises((DftfsError, RseaError)) as refused:
        READERS[reader](path)
    assert one_line(str(refused.value)).isprintable()
