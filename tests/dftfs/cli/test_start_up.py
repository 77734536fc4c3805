"""The help of a command imports none of what its work needs: it is there in a third of a second."""

import subprocess
import sys

COMMANDS = ("doctor", "diagnose", "study", "simulate", "shape", "export", "new", "completion")
HEAVY = ("scipy", "numba", "matplotlib", "cadquery", "gmsh", "rsea_core.engines")
PROGRAM = f"""
import sys
from dftfs.cli.main import parser
for name in {COMMANDS}:
    assert parser([name, "--help"]) is not None
    print(name, *(library for library in {HEAVY} if library in sys.modules))
"""


def test_help_imports_no_solver_and_no_library_for_figures():
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True)
    assert done.stdout.split("\n")[:-1] == list(COMMANDS), done.stdout + done.stderr
