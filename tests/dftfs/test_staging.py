"""Files appear whole or not at all, with the modes of the umask; the leftovers of the dead go."""

import os
import stat
import subprocess
import sys

import pytest

from dftfs.files import OutputError, prepare_folder, write_text
from dftfs.staging import reason, staged, staging_folder, sweep_stale, written_whole


@pytest.mark.parametrize(("mask", "mode"), [(0o022, 0o644), (0o077, 0o600), (0o002, 0o664)])
def test_a_result_has_the_mode_that_the_umask_leaves(tmp_path, mask, mode):
    before = os.umask(mask)
    try:
        path = write_text(tmp_path / "a.json", "{}")
    finally:
        os.umask(before)
    assert stat.S_IMODE(path.stat().st_mode) == mode


def test_what_fails_while_writing_leaves_the_earlier_file_and_nothing_else(tmp_path):
    target = write_text(tmp_path / "a.csv", "old")

    def interrupted():
        with written_whole(target) as unfinished:
            unfinished.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert [p.name for p in tmp_path.iterdir()] == ["a.csv"]
    assert target.read_text() == "old"


def test_leftovers_of_a_process_that_is_no_more_are_swept_and_those_of_a_living_one_stay(tmp_path):
    code = "import sys, pathlib; from dftfs.staging import staged\n"
    code += "t = pathlib.Path(sys.argv[1])\n"
    code += "staged(t / 'a.csv').write_text('half'); staged(t / 'unfinished').mkdir()"
    subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=True)
    mine = staged(tmp_path / "b.csv")
    mine.write_text("in work")
    other = tmp_path / ".hidden.of.somebody"
    other.write_text("kept")
    assert len(list(tmp_path.iterdir())) == 4
    prepare_folder(tmp_path)
    assert sorted(tmp_path.iterdir()) == sorted([mine, other])


def test_a_staging_folder_is_gone_at_the_end(tmp_path):
    with staging_folder(tmp_path) as unfinished:
        (unfinished / "a").write_text("x")
    assert not list(tmp_path.iterdir())
    sweep_stale(tmp_path / "none")


def test_a_full_disk_is_named():
    assert reason(OSError(28, "No space left on device")) == "the disk is full"
    if os.path.exists("/dev/full"):
        with pytest.raises(OSError, match="No space") as refused, open("/dev/full", "w") as file:
            file.write("x" * 10_000_000)
        assert reason(refused.value) == "the disk is full"


def test_a_folder_that_cannot_be_written_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot be written"):
        prepare_folder(tmp_path / "file" / "below")
