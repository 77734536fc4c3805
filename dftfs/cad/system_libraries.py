"""Shared libraries that the CAD, meshing and rendering wheels expect of the operating system.

The wheels of OCP (the kernel under cadquery), gmsh and VTK carry most of what they need; what is
left is listed here: every soname outside the wheels that one of them names directly (readelf -d
on each of their .so files), and what VTK opens at run time to draw without a screen.

`python -m dftfs.cad.system_libraries` prints the Debian packages that are missing, for `make`: it
runs before there is an environment.
"""

import ctypes
import sys
from collections.abc import Callable, Sequence
from importlib.util import find_spec

# soname, package of Debian 12; libgl1 brings Mesa's driver with it.
SYSTEM_LIBRARIES: tuple[tuple[str, str], ...] = (
    ("libstdc++.so.6", "libstdc++6"),  # all of them
    ("libgcc_s.so.1", "libgcc-s1"),
    ("libz.so.1", "zlib1g"),  # gmsh
    ("libgomp.so.1", "libgomp1"),
    ("libX11.so.6", "libx11-6"),  # OCP, gmsh
    ("libGL.so.1", "libgl1"),
    ("libexpat.so.1", "libexpat1"),  # OCP
    ("libGLU.so.1", "libglu1-mesa"),  # gmsh
    ("libXrender.so.1", "libxrender1"),
    ("libXcursor.so.1", "libxcursor1"),
    ("libXfixes.so.3", "libxfixes3"),
    ("libXext.so.6", "libxext6"),
    ("libXft.so.2", "libxft2"),
    ("libXinerama.so.1", "libxinerama1"),
    ("libfontconfig.so.1", "libfontconfig1"),
    ("libEGL.so.1", "libegl1"),  # VTK, off-screen
)


def missing_system_libraries(
    required: Sequence[tuple[str, str]] = SYSTEM_LIBRARIES,
    *,
    loads: Callable[[str], bool] | None = None,
) -> list[tuple[str, str]]:
    """The required (soname, Debian package) pairs whose library cannot be loaded, in order.

    Empty on other systems than Linux, whose wheels bring their own. ``loads`` says whether a
    soname can be loaded; by default the dynamic loader is asked.
    """
    if not sys.platform.startswith("linux"):
        return []
    check = loads or _loads
    return [(soname, package) for soname, package in required if not check(soname)]


def missing_libraries_message(missing: Sequence[tuple[str, str]]) -> str:
    """One line that names the missing libraries and what installs them; empty if none is."""
    if not missing:
        return ""
    sonames = ", ".join(soname for soname, _ in missing)
    packages = " ".join(dict.fromkeys(package for _, package in missing))
    return f"missing system libraries: {sonames}; on Debian: apt-get install {packages}"


def _loads(soname: str) -> bool:
    try:
        ctypes.CDLL(soname)
    except OSError:
        return False
    return True


def missing_packages(missing: Sequence[tuple[str, str]]) -> list[str]:
    """The Debian packages of missing libraries, after the one of `venv` where Python lacks it."""
    venv = [] if find_spec("venv") and find_spec("ensurepip") else ["python3-venv"]
    return [*venv, *dict.fromkeys(package for _, package in missing)]


if __name__ == "__main__":
    print(*missing_packages(missing_system_libraries()))
