"""A recording is a table, a data set and a figure, as a trajectory is."""

import numpy as np
import pytest

from rsea_core.recordings.recording import Recording


def test_a_recording_is_a_pandas_table_an_xarray_data_set_and_a_figure():
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    pytest.importorskip("matplotlib").use("Agg")
    time = np.arange(20) * 1e-3
    columns = {"torque_Nm": np.sin(time), "duty": 0 * time, "time_s": time}
    own = Recording(file="<r>.csv", columns=columns, sample_time_s=1e-3)
    assert list(own.to_pandas().columns) == ["torque_Nm", "duty"]
    assert own.to_xarray()["torque_Nm"].attrs["units"] == "Nm"
    assert [axes.get_ylabel() for axes in own.plot().axes] == ["torque_Nm", "duty"]
    assert "&lt;r&gt;.csv" in own._repr_html_()
