"""Parameters of effects within the sizes of a bench: their own bounds hold for any machine."""

MOST = (
    ("viscous_skew_Nms_per_rad", 0.1),
    ("coulomb_Nm", 1.0),
    ("_Nms2_per_rad2", 10.0),
    ("_Nms_per_rad", 20.0),
    ("_Nm_per_rad", 1e3),
    ("_Nm", 1.0),
    ("velocity_rad_per_s", 10.0),
    ("presliding_rad", 0.05),
    ("bristle_rad", 0.05),
    ("yield_rad", 1.0),
    ("time_1_s", 1e3),
    ("time_2_s", 1e3),
    ("time_3_s", 1e3),
)
"""Largest sizes by the end of a name, the first that fits."""
LEAST = (("velocity_rad_per_s", 5e-3), ("yield_rad", 1e-3), ("_s", 1e-3))


def bench_box(name: str, bounds: tuple[float, float]) -> tuple[float, float]:
    """The part of a parameter's bounds that a bench could have."""
    low, high = bounds
    most = next((size for end, size in MOST if name.endswith(end)), high)
    least = next((size for end, size in LEAST if name.endswith(end)), low)
    return max(low, -most, least if low > 0.0 else low), min(high, most)
