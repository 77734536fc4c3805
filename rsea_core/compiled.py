"""A version number for the on-disk cache of compiled code.

numba renews a cached function when the file that holds it changes, not when a function that
it calls in another file does. An entry point whose closure holds `SOURCE_VERSION` is renewed
whenever a source with compiled code changes, because numba's cache key covers closures.
"""

import zlib
from pathlib import Path


def _source_version() -> int:
    root = Path(__file__).parent
    version = 1
    for path in sorted(root.rglob("*.py")):
        source = path.read_bytes()
        if b"numba" in source:
            version = zlib.crc32(source, version)
    return version


SOURCE_VERSION: int = _source_version()
