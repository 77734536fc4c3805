"""Results by rows as a pandas table, an xarray data set and a matplotlib figure."""

from collections.abc import Mapping
from importlib import import_module

from numpy.typing import NDArray

from rsea_core.errors import InputError
from rsea_core.files.csv_columns import unit_of


class ColumnViews:
    """Base of results that have columns over ``time_s``; libraries are loaded where they serve."""

    def named_columns(self) -> Mapping[str, NDArray]:
        """Every column by its name, ``time_s`` first."""
        raise NotImplementedError

    def to_pandas(self):
        """All columns as a pandas table with the time as its index.

        Raises
        ------
        InputError
            If pandas is not installed.
        """
        columns = dict(self.named_columns())
        index = library("pandas").Index(columns.pop("time_s"), name="time_s")
        return library("pandas").DataFrame(columns, index=index)

    def to_xarray(self):
        """All columns as an xarray data set over time_s, with their units as attributes.

        Raises
        ------
        InputError
            If xarray is not installed.
        """
        columns = dict(self.named_columns())
        time = {"time_s": columns.pop("time_s")}
        made = {
            name: ("time_s", values, {"units": unit_of(name)}) for name, values in columns.items()
        }
        return library("xarray").Dataset(made, coords=time)

    def plot(self):
        """Every column against time, one below the other: a matplotlib figure.

        Raises
        ------
        InputError
            If matplotlib is not installed.
        """
        columns = dict(self.named_columns())
        time = columns.pop("time_s")
        figure, axes = library("matplotlib.pyplot").subplots(
            len(columns), 1, sharex=True, squeeze=False, layout="constrained",
            figsize=(8, 1 + 1.7 * len(columns)),
        )  # fmt: skip
        for own, (name, values) in zip(axes[:, 0], columns.items(), strict=True):
            own.plot(time, values, lw=1.0)
            own.set_ylabel(name)
        axes[-1, 0].set_xlabel("time_s")
        return figure


def library(name: str):
    """An optional library, where it is used.

    Raises
    ------
    InputError
        If it is not installed.
    """
    try:
        return import_module(name)
    except ImportError as problem:
        needed = name.split(".")[0]
        raise InputError(f"{needed} is not installed: pip install {needed}") from problem
