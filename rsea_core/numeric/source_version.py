"""A version number for the on-disk cache of compiled code.

numba renews a cached function when the file that holds it changes, not when a function that
it calls in another file does. An entry point whose closure holds `SOURCE_VERSION` is renewed
whenever a source with compiled code changes, because numba's cache key covers closures. For all
other cached functions `forget_stale` empties the package's cache when any source has changed.
"""

import zlib
from pathlib import Path


def _source_version() -> int:
    root = Path(__file__).parents[1]
    version = 1
    for path in sorted(root.rglob("*.py")):
        source = path.read_bytes()
        if b"numba" in source or b"@hook" in source:
            version = zlib.crc32(source, version)
    return version


SOURCE_VERSION: int = _source_version()


def forget_stale(root: Path, version: int) -> None:
    """Delete the compiled code that numba kept under `root` from sources of another version.

    A folder that cannot be written is left as it is: nothing was cached there either.
    """
    stamp = root / "__pycache__" / "compiled-from"
    try:
        if stamp.exists() and stamp.read_text() == str(version):
            return
        for kind in ("*.nbi", "*.nbc"):
            for path in root.rglob(f"__pycache__/{kind}"):
                path.unlink(missing_ok=True)
        stamp.parent.mkdir(exist_ok=True)
        stamp.write_text(str(version))
    except OSError:
        return


forget_stale(Path(__file__).parents[1], SOURCE_VERSION)
