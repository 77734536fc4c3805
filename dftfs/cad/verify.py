"""What every CAD file must pass after it was written, and the error when it does not."""

from dftfs.errors import DftfsError


class CadError(DftfsError):
    """The CAD kernel made a solid or a file that is not the outline it was given."""

    exit_status = 3


def require(condition: bool, what: str) -> None:
    """Raise `CadError` with one line unless the condition holds."""
    if not condition:
        raise CadError(what)


def require_close(what: str, value: float, expected: float, rtol: float) -> float:
    """The relative error, or `CadError` if it exceeds ``rtol``."""
    error = float(abs(value / expected - 1))
    require(
        error <= rtol,
        f"{what} is {value:.9g} and must be {expected:.9g}: off by {error:.2e}, at most {rtol:.0e}",
    )
    return error
