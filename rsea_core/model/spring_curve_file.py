"""A spring's torque-deflection curve from a file."""

from pathlib import Path

from rsea_core.effects.registry import SpringCurve
from rsea_core.errors import TermError
from rsea_core.files.csv_columns import read_columns


def read_spring_curve(path: str | Path) -> SpringCurve:
    """The curve of a CSV file: deflection_rad, torque_Nm and optionally tangent_Nm_per_rad.

    Raises
    ------
    TermError
        If the file cannot be read or its points cannot be used.
    """
    columns = read_columns(
        path,
        TermError,
        required=("deflection_rad", "torque_Nm"),
        optional=("tangent_Nm_per_rad",),
    )
    try:
        return SpringCurve(**columns, source=str(path))
    except TermError as problem:
        raise TermError(f"{path}: {problem}") from problem
