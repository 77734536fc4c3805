"""`dftfs deck` refuses what it cannot state in one line, before anything is solved."""

import pytest

from dftfs.cli.main import main


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("--at-rad", "0"), "for example --at-rad 0.05 0.1"),
        (("--at-rad", "nan"), "for example --at-rad 0.05 0.1"),
        (("--at-rad",), "for example dftfs deck al1 --at-rad 0.05 0.1"),
        (("--size", "0"), "mesh size = 0 must be 0.1 to 4, for example 0.5"),
    ],
)
def test_a_deflection_or_mesh_that_is_none_is_refused(
    options, expected, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    try:
        status = main(["deck", "al1", *options])
    except SystemExit as end:
        status = end.code
    assert status == 2
    assert expected in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
