"""Arrays that stay as they were made."""

from numpy.typing import NDArray


def read_only(array: NDArray) -> NDArray:
    """The same array, closed for writing."""
    array.setflags(write=False)
    return array
