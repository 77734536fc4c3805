"""The errors that a user can cause or must know of.

Each message is one line: what is wrong, where, what is allowed. The command line prints it
as it is; ``exit_status`` is what the process then returns (2 wrong input, 3 a solver failed).
"""


class DftfsError(Exception):
    """Base of every error that the command line prints without a traceback."""

    exit_status = 2


class DesignError(DftfsError):
    """A design, material or file that cannot be used as it stands."""


class MeshError(DftfsError):
    """The mesh generator failed or made elements that must not be solved on."""

    exit_status = 3


class SolveError(DftfsError):
    """A solver did not converge; the message says at which load and what would help."""

    exit_status = 3
