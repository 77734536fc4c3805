"""The errors that a user of the actuator can cause or must know of.

Each message is one line: what is wrong, where, what is allowed. A command line prints it as
it is; ``exit_status`` is what the process then returns (2 wrong input, 3 a solver failed).
"""


class RseaError(Exception):
    """Base of every error that a command line prints without a traceback."""

    exit_status = 2


class RigError(RseaError):
    """A rig that cannot be used as it stands, or that lacks a value a computation needs."""


class TermError(RseaError):
    """A physics term with a parameter outside its bounds or data that cannot be used."""


class InputError(RseaError):
    """Inputs, a load or a reference that cannot be simulated as they stand."""


class ControllerError(RseaError):
    """A controller that cannot work: unstable gains, a sample time that does not fit."""


class ScenarioError(RseaError):
    """A scenario file with a missing, unknown or unusable entry."""


class RecordingError(RseaError):
    """A case, a recording or a test recording that breaks the file contract."""


class SimulationError(RseaError):
    """The integration did not reach the end; the message says when and what would help."""

    exit_status = 3
