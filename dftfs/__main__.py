"""`python -m dftfs`: the program `dftfs`, where its script is not on the path."""

import sys

from dftfs.cli.main import program

sys.exit(program())
