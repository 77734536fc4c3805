"""Opening files that others wrote: regular files of a bounded size, everything else refused.

A device or a pipe given as a file would block or never end, and a file of gigabytes would fill the
memory before its first line is judged.
"""

import os
import stat
from pathlib import Path

MOST_TOML_BYTES = 4_000_000
MOST_TABLE_BYTES = 2_000_000_000


def require_regular(path: str | Path, error: type[Exception], *, most_bytes: int) -> None:
    """Refuse what is not a regular file of at most so many bytes.

    Raises
    ------
    error
        One line that names the file and what would do.
    """
    try:
        found = os.stat(path)
    except OSError as problem:
        raise error(f"{path}: cannot be read: {problem.strerror or problem}") from problem
    except ValueError:
        raise error(f"{str(path)!r}: cannot be read: no file has this name") from None
    if stat.S_ISDIR(found.st_mode):
        raise error(f"{path}: cannot be read: is a folder")
    if not stat.S_ISREG(found.st_mode):
        raise error(f"{path}: cannot be read: is a device or a pipe, not a regular file")
    if found.st_size > most_bytes:
        raise error(
            f"{path}: has {found.st_size / 1e6:.1f} MB; such a file may have {most_bytes / 1e6:g}"
        )


def read_bounded(
    path: str | Path, error: type[Exception], *, most_bytes: int = MOST_TABLE_BYTES
) -> str:
    """The UTF-8 text of a regular file, without a byte-order mark.

    Raises
    ------
    error
        If it cannot be read, is not a regular file, is too large or not UTF-8 text.
    """
    require_regular(path, error, most_bytes=most_bytes)
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except OSError as problem:
        raise error(f"{path}: cannot be read: {problem.strerror or problem}") from problem
    except UnicodeDecodeError as problem:
        raise error(f"{path}: is not UTF-8 text (byte {problem.start})") from problem
