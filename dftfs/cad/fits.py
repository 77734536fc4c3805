"""The hole tolerance H7: its upper deviation over the nominal diameter; the lower one is zero.

Source: ISO 286-1:2010, table 1 (standard tolerance grade IT7), nominal sizes up to 3150 mm.
"""

from bisect import bisect_left

from dftfs.errors import DesignError

# upper end of a range of nominal sizes in mm, IT7 in micrometres
_IT7 = (
    (3, 10), (6, 12), (10, 15), (18, 18), (30, 21), (50, 25), (80, 30), (120, 35), (180, 40),
    (250, 46), (315, 52), (400, 57), (500, 63), (630, 70), (800, 80), (1000, 90), (1250, 105),
    (1600, 125), (2000, 150), (2500, 175), (3150, 210),
)  # fmt: skip


def h7_m(diameter_m: float) -> float:
    """How much larger than nominal a hole H7 may be, in m.

    Raises
    ------
    DesignError
        If the diameter is not above 0 and at most 3150 mm, where the table ends.
    """
    size = round(1e3 * diameter_m, 6)  # 30 mm computed as 30.000000000000004 is 30
    if not 0 < size <= _IT7[-1][0]:
        raise DesignError(
            f"a bore of {size:g} mm has no H7: its diameter must be above 0, at most"
            f" {_IT7[-1][0]} mm (ISO 286-1)"
        )
    return 1e-6 * _IT7[bisect_left([end for end, _ in _IT7], size)][1]
