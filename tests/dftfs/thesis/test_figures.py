"""Figures of the thesis: each of the asked ranges is drawn or has its reason."""

import json

from dftfs.cli.main import main
from dftfs.thesis.figures import REASONS

ASKED = [("2", 24, 26), ("3", 3, 4), ("4", 2, 21), ("5", 10, 41)]


def test_every_asked_figure_has_a_line(tmp_path, capsys):
    covered = {
        (first.split(".")[0], number)
        for first, last, _, _ in REASONS
        for number in range(int(first.split(".")[1]), int(last.split(".")[1]) + 1)
    }
    assert {(chapter, n) for chapter, low, high in ASKED for n in range(low, high + 1)} <= covered
    folder = tmp_path / "figures"
    asked = ["thesis", "--only", "control", "--json", "--figures", str(folder)]
    assert main(asked) == 0
    tables = {row["table"] for row in json.loads(capsys.readouterr().out)["rows"]}
    listed = (folder / "figures.md").read_text(encoding="utf-8")
    pictures = {path.name for path in folder.glob("*.png")}
    assert {"membership.png", "surface.png", "table-5-3.png"} <= pictures
    assert "5.3" in tables
    assert all(f"`{name}`" in listed for name in pictures if name.startswith("table-"))
    assert all((folder / name).stat().st_size > 5000 for name in pictures)
    assert main(asked) == 2  # does not overwrite
