"""What is arithmetic in the thesis' control tables comes out of its own numbers, or is named."""

import pytest

from rsea_core.performance.thesis_row import MEASURED, ORDER, REPRODUCED
from rsea_core.performance.thesis_tables import control_rows


@pytest.fixture(scope="module")
def rows():
    return {(row.table, row.what): row for row in control_rows()}


def test_one_improvement_of_table_5_8_uses_the_old_value_and_the_others_the_new(rows):
    """Errata R1: 11.33 % is (old - new) / old, the rest are divided by the new value."""
    reproduced = [w for (t, w), row in rows.items() if t == "5.8" and row.verdict == REPRODUCED]
    assert reproduced == ["FHIC-H against HIC, position"]
    other = rows["5.8", "FHIC-S against HIC, position"]
    assert other.recomputed == pytest.approx(9.494, abs=1e-3)
    assert "10.49 %" in other.note


def test_table_5_11_does_not_follow_from_table_5_10(rows):
    """Errata R2: 22.7 and 36.3 % where 11.38 and 18.15 are printed; one sign is wrong."""
    assert rows["5.11", "AFHI against HI, position"].recomputed == pytest.approx(22.69, abs=0.01)
    assert rows["5.11", "AFHI against HI, force"].recomputed == pytest.approx(36.28, abs=0.01)
    assert rows["5.11", "FHI-M against FHI-S, position"].recomputed < 0.0


def test_settling_of_the_position_has_the_published_order(rows):
    times = [rows["5.4-5.6", f"settling of position, {e}"] for e in ("soft", "medium", "hard")]
    assert [row.verdict for row in times] == [ORDER] * 3
    assert times[0].recomputed > times[1].recomputed > times[2].recomputed


def test_margins_of_table_5_9_are_called_impossible(rows):
    found = {what: row.verdict for (t, what), row in rows.items() if t == "5.9"}
    assert {verdict for what, verdict in found.items() if what.startswith("FHIC")} == {"impossible"}
    assert found["PD: gain margin"] == MEASURED


def test_table_4_2_is_in_order_once_its_columns_are_exchanged_back(rows):
    """Errata C6: three of seven rows fall as printed, all of them with ZE and PS exchanged."""
    found = [row.recomputed for (t, w), row in rows.items() if t == "4.2" and "of 7" in w]
    assert found == [3.0, 7.0]


def test_gains_of_table_4_1_are_unstable_on_the_free_joint_in_both_readings(rows):
    poles = [row for (t, _), row in rows.items() if t == "4.1"]
    assert len(poles) == 4
    assert {row.verdict for row in poles} == {"unstable"}


def test_every_table_of_the_controllers_has_its_rows(rows):
    tables = {table for table, _ in rows}
    asked = {"2.1", "2.8", "3.1", "4.5", "4.6", "4.7", "5.1", "5.2", "5.7", "5.10", "5.12"}
    assert asked <= tables
    columns = [what for table, what in rows if table == "5.4-5.6"]
    assert len(columns) == 36  # 3 figures of position and force, 3 modes, both kinds of row


def test_the_printed_rotation_of_the_chain_has_no_determinant(rows):
    """Errata D4: its columns are shifted; the product of Table 2.8 is a rotation."""
    found = next(row for (t, w), row in rows.items() if t == "2.8" and "determinant" in w)
    assert found.printed == pytest.approx(0.0, abs=1e-15)
    assert found.recomputed == pytest.approx(1.0)


def test_the_data_sheet_of_the_motor_disagrees_with_itself_in_four_numbers(rows):
    wrong = {row.errata for (t, _), row in rows.items() if t == "5.1" and row.errata}
    assert wrong == {"D13", "D16", "D17"}


def test_a_self_locking_worm_cannot_have_the_efficiency_that_is_printed(rows):
    worst = next(row for (t, w), row in rows.items() if t == "5.2" and "worm" in w)
    assert worst.recomputed < 50.0 < worst.printed
