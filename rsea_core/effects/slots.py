"""Places of the effects' numbers in the one array that compiled code reads.

Each effect claims the places of its own numbers by name, in its own file. The order is that of
the imports in `registry`, which the package makes before any other import of one of its modules:
compiled code that is kept on disk has the places as constants.
"""

_NAMES: list[str] = []
REMEMBERS: set[int] = set()
"""Places whose numbers give a machine internal states."""
USER_PLACES = 64  # for effects that are registered later, see `user`


def slots(*names: str, memory: bool = False) -> int | tuple[int, ...]:
    """The places of new numbers; one name gives one place.

    Parameters
    ----------
    memory : bool
        Whether a machine has internal states where these numbers are not zero.

    Raises
    ------
    ValueError
        If a name is taken.
    """
    taken = [name for name in names if name in _NAMES]
    if taken:
        raise ValueError(f"numbers named {', '.join(taken)} are claimed already")
    first = len(_NAMES)
    _NAMES.extend(names)
    found = tuple(range(first, first + len(names)))
    if memory:
        REMEMBERS.update(found)
    return found if len(found) > 1 else found[0]


def block(name: str, count: int, *, memory: bool = False) -> int:
    """The first of `count` places in a row, named <name>_1, <name>_2 ..."""
    slots(*(f"{name}_{j}" for j in range(1, count + 1)), memory=memory)
    return len(_NAMES) - count


def place_of(name: str) -> int:
    """The place of a number."""
    return _NAMES.index(name)


def names() -> tuple[str, ...]:
    """All numbers claimed so far, in the order of their places."""
    return tuple(_NAMES)


ANY, MEMORY = slots("any", "memory")  # whether a model has effects at all, and internal states
