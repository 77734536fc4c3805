"""Places of the effects' numbers in the one array that compiled code reads.

Each effect claims the places of its own numbers by name, in its own file. The order is that of
the imports in `registry`, which the package makes before any other import of one of its modules:
compiled code that is kept on disk has the places as constants.
"""

_NAMES: list[str] = []
_LATER: dict[str, int] = {}  # of effects that are registered by users
_CLOSED: list[int] = []  # the first place of users, once compiled code has the others
REMEMBERS: set[int] = set()
"""Places whose numbers give a machine internal states."""
USER_PLACES = 64  # for effects that are registered by users


def slots(*names: str, internal: bool = False) -> int | tuple[int, ...]:
    """The places of new numbers; one name gives one place.

    Parameters
    ----------
    internal : bool
        Whether a machine has internal states where these numbers are not zero.

    Raises
    ------
    ValueError
        If a name is taken.
    """
    taken = [name for name in names if name in _NAMES or name in _LATER]
    if taken:
        raise ValueError(f"numbers named {', '.join(taken)} are claimed already")
    if _CLOSED:
        found = _later(names, internal)
        return found if len(found) > 1 else found[0]
    first = len(_NAMES)
    _NAMES.extend(names)
    found = tuple(range(first, first + len(names)))
    if internal:
        REMEMBERS.update(found)
    return found if len(found) > 1 else found[0]


def _later(names: tuple[str, ...], internal: bool) -> tuple[int, ...]:
    if internal:
        raise ValueError("effects of users have no internal states")
    if len(_LATER) + len(names) > USER_PLACES:
        raise ValueError(f"effects of users have at most {USER_PLACES} numbers in all")
    found = tuple(_CLOSED[0] + len(_LATER) + k for k in range(len(names)))
    _LATER.update(zip(names, found, strict=True))
    return found


def close(first: int) -> None:
    """From now on numbers are those of users: compiled code has all other places as constants."""
    if not _CLOSED:
        _CLOSED.append(first)


def block(name: str, count: int, *, internal: bool = False) -> int:
    """The first of `count` places in a row, named <name>_1, <name>_2 ..."""
    slots(*(f"{name}_{j}" for j in range(1, count + 1)), internal=internal)
    return len(_NAMES) - count


def place_of(name: str) -> int:
    """The place of a number."""
    return _LATER[name] if name in _LATER else _NAMES.index(name)


def names() -> tuple[str, ...]:
    """All numbers claimed so far, in the order of their places."""
    return tuple(_NAMES)


ANY, INTERNAL_STATES = slots(
    "any", "internal_states"
)  # whether a model has effects at all, and internal states
