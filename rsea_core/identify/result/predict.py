"""Readings that a diagnosed machine will give in test recordings, as arrays."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from numpy.typing import NDArray

from rsea_core.errors import InputError
from rsea_core.files.column_views import ColumnViews
from rsea_core.identify.result.corrected_model import FoundModel
from rsea_core.identify.result.diagnosis import Diagnosis
from rsea_core.numeric.brief_repr import BriefRepr
from rsea_core.recordings.case import read_test


@dataclass(frozen=True, kw_only=True, repr=False)
class Prediction(ColumnViews, BriefRepr):
    """Predicted readings of one test recording.

    Attributes
    ----------
    file, description : str
        Of the test recording.
    columns : mapping of name -> (n,) array
        time_s and, as far as the rig has them, motor_angle_rad, load_angle_rad, torque_Nm.
    """

    file: str
    description: str = ""
    columns: Mapping[str, NDArray]

    def named_columns(self) -> Mapping[str, NDArray]:
        """`columns`, for tables, data sets and figures."""
        return self.columns

    def __getitem__(self, name: str) -> NDArray:
        return self.columns[name]

    def __contains__(self, name: str) -> bool:
        return name in self.columns


def predict(
    model: Diagnosis | FoundModel | str | Path, folder: str | Path
) -> dict[str, Prediction]:
    """Predict the readings of a machine for new inputs, as `dftfs predict` does.

    Parameters
    ----------
    model : Diagnosis, or path of the `model.toml` that it wrote
    folder : path
        With a `test.toml` and the files that it lists (docs/recordings.md).

    Returns
    -------
    dict of file -> Prediction
        In the order of `test.toml`; `predict(...)["input.csv"]["torque_Nm"]` is an (n,) array.

    Raises
    ------
    RseaError
        If the model or the folder cannot be read.
    InputError
        If `model` is neither.
    """
    if isinstance(model, str | Path):
        model = FoundModel.from_toml(model)
    elif isinstance(model, Diagnosis):
        model = model.model
    elif not isinstance(model, FoundModel):
        raise InputError(
            f"predict: {type(model).__name__} is neither a Diagnosis nor the path of a model.toml"
        )
    return {
        test.file: Prediction(
            file=test.file, description=test.description, columns=model.predict(test)
        )
        for test in read_test(folder, model.rig)
    }
