"""A PDF is printed whole by a browser that is there, and refused in words where none is."""

import pytest

from dftfs.cli.main import main
from dftfs.errors import DftfsError
from dftfs.report.pdf import write_pdf

PRINTS = """#!/bin/sh
for word in "$@"; do
  case "$word" in --print-to-pdf=*) printf '%%PDF-1.4' > "${word#--print-to-pdf=}";; esac
done
"""


def browser(folder, monkeypatch, text):
    (folder / "chromium").write_text(text)
    (folder / "chromium").chmod(0o755)
    monkeypatch.setenv("PATH", f"{folder}:/usr/bin:/bin")


def test_the_pdf_has_the_name_and_folder_of_its_page(tmp_path, monkeypatch):
    browser(tmp_path, monkeypatch, PRINTS)
    page = tmp_path / "a page.html"
    page.write_text("<p>x</p>")
    assert write_pdf(page) == tmp_path / "a page.pdf"
    assert (tmp_path / "a page.pdf").read_bytes() == b"%PDF-1.4"


def test_a_browser_that_prints_nothing_is_named_and_an_older_pdf_stays(tmp_path, monkeypatch):
    browser(tmp_path, monkeypatch, "#!/bin/sh\nexit 1\n")
    (tmp_path / "page.html").write_text("<p>x</p>")
    (tmp_path / "page.pdf").write_text("older")
    with pytest.raises(DftfsError, match="chromium did not print it"):
        write_pdf(tmp_path / "page.html")
    assert (tmp_path / "page.pdf").read_text() == "older"


def test_without_a_browser_the_command_is_refused_before_its_work(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert main(["study", "al1", "--pdf", "--out", str(tmp_path / "out")]) == 2
    assert "--pdf needs a browser that prints: one of chromium" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
