"""The page of a command shows every cell of the tables and every line that the command prints."""

from dftfs.cli.common import table
from dftfs.files import write_bytes
from dftfs.report.page_data import draw_again
from dftfs.report.result_page import parts, write_result_page

HEAD = ["cause", "relative slope", "of variance", "note"]
ROWS = [["modulus <E>", "+1.00", "63 %", ""], ["kerf", "-2.98", "5 %", "cut twice"]]
TEXT = "\n".join(
    ["stiffness: 65.4 Nm/rad", "", "what causes it:", table(HEAD, ROWS), "kerf is cut", "out/a.png"]
)


def test_lines_and_tables_of_a_text_are_found_with_all_their_cells():
    lines, (found,) = parts(TEXT)
    assert lines == ["stiffness: 65.4 Nm/rad", "kerf is cut"]
    assert found.caption == "what causes it:"
    assert found.head == tuple(HEAD)
    assert found.rows == tuple(map(tuple, ROWS))
    assert found.numeric == (1, 2)


def test_a_text_without_a_table_is_lines():
    assert parts("one\ntwo words") == (["one", "two words"], [])


def test_the_page_is_drawn_again_as_it_was_and_states_its_inputs(tmp_path):
    given = tmp_path / "d.toml"
    given.write_text("x = 1\n")
    picture = write_bytes(tmp_path / "spread.png", b"\x89PNG")
    page = write_result_page(
        tmp_path / "report.html", title="Spread <1>", kicker="dftfs tolerance", text=TEXT,
        pictures=[picture], inputs=[given, tmp_path / "no file"],
    )  # fmt: skip
    text = page.read_text()
    assert "modulus &lt;E&gt;" in text
    assert "Spread &lt;1&gt;" in text
    assert "SHA-256 of d.toml" in text
    assert draw_again(tmp_path / "report.page.npz", tmp_path) == ("report.html", text)
