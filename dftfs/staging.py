"""Files that appear whole or not at all: written under a hidden name beside the target, renamed.

The hidden name holds process and machine, so that what a killed process left behind is known and
swept by the next one that writes into the folder. Modes are those that the umask leaves.
"""

import errno
import itertools
import os
import platform
import re
import shutil
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_MACHINE = f"{zlib.crc32(platform.node().encode()):08x}"
_STAGED = re.compile(rf"\..*\.(\d+)(?:-{_MACHINE}-\d+)?\.part")  # the core writes without the rest
_COUNT = itertools.count()


def reason(error: OSError) -> str:
    """Why a file could not be written, in words."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return "the disk is full"
    return error.strerror or str(error)


def staged(target: Path) -> Path:
    """A hidden path beside a target that no other process and no other call uses."""
    return target.with_name(f".{target.name[:100]}.{os.getpid()}-{_MACHINE}-{next(_COUNT)}.part")


@contextmanager
def written_whole(target: Path) -> Iterator[Path]:
    """A path to write to, renamed to the target when the block ends without an error.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    staging = staged(target)
    try:
        yield staging
        staging.replace(target)
    finally:
        staging.unlink(missing_ok=True)


@contextmanager
def staging_folder(folder: Path) -> Iterator[Path]:
    """A hidden folder inside another one, removed at the end with what is still in it.

    Raises
    ------
    OSError
        If it cannot be made.
    """
    staging = staged(folder / "unfinished")
    staging.mkdir()
    try:
        yield staging
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def sweep_stale(folder: Path) -> None:
    """Remove what processes of this machine that are no more left unfinished in a folder."""
    with suppress(OSError):
        for path in folder.iterdir():
            found = _STAGED.fullmatch(path.name)
            if found is None or _runs(int(found[1])):
                continue
            if path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)


def _runs(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True
