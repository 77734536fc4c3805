"""The list of system libraries is what the wheels load, and a missing one is named."""

import subprocess
import sys

import pytest

from dftfs.cad.system_libraries import (
    SYSTEM_LIBRARIES,
    missing_libraries_message,
    missing_system_libraries,
)

linux_only = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="sonames of Linux")


@linux_only
def test_nothing_is_missing_where_the_kernel_and_the_mesher_import():
    assert missing_system_libraries() == []


@linux_only
def test_a_library_that_is_not_there_is_reported_with_its_package():
    required = (("libc.so.6", "libc6"), ("libnot-there.so.9", "libnot-there9"))

    assert missing_system_libraries(required) == [("libnot-there.so.9", "libnot-there9")]


@linux_only
def test_missing_libraries_keep_their_order_and_read_as_one_line():
    absent = {"libGL.so.1", "libGLU.so.1"}

    missing = missing_system_libraries(loads=lambda soname: soname not in absent)

    assert missing == [("libGL.so.1", "libgl1"), ("libGLU.so.1", "libglu1-mesa")]
    assert missing_libraries_message(missing) == (
        "missing system libraries: libGL.so.1, libGLU.so.1;"
        " on Debian: apt-get install libgl1 libglu1-mesa"
    )
    assert missing_libraries_message([]) == ""


@linux_only
def test_every_listed_library_is_one_that_the_wheels_load():
    code = "import OCP.BRep, gmsh\nprint(open('/proc/self/maps').read())"
    run = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)

    unused = [soname for soname, _ in SYSTEM_LIBRARIES if f"/{soname}" not in run.stdout]

    assert unused == ["libEGL.so.1"]  # opened by VTK only when it draws
