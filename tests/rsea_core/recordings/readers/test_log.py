"""A single number beside a file's arrays that is their rate is read with them."""

import json

import numpy as np
import pytest

from rsea_core.recordings.readers.log import rate_of
from rsea_core.recordings.readers.open_log import open_log

ARRAYS = {"pos": np.sin(np.arange(50.0)), "cmd": np.arange(50.0)}


@pytest.mark.parametrize("kind", ["npz", "mat", "json", "h5", "attribute"])
def test_every_format_with_single_numbers_has_its_rate(kind, tmp_path):
    path = tmp_path / f"log.{kind if kind != 'attribute' else 'h5'}"
    if kind == "npz":
        np.savez(path, **ARRAYS, rate_hz=250)
    elif kind == "mat":
        from scipy.io import savemat

        savemat(path, {"exo": {**ARRAYS, "fs": 250.0}})
    elif kind == "json":
        path.write_text(json.dumps({n: v.tolist() for n, v in ARRAYS.items()} | {"dt": 0.004}))
    else:
        h5py = pytest.importorskip("h5py")
        with h5py.File(path, "w") as file:
            for name, values in ARRAYS.items():
                file[name] = values
            if kind == "h5":
                file["Fs"] = 250.0
            else:
                file.attrs["sample_rate"] = 250.0
    name, rate = open_log(path).rate
    assert name in ("rate_hz", "exo.fs", "dt", "Fs", "sample_rate")
    assert rate == pytest.approx(250.0)


@pytest.mark.parametrize(
    "numbers",
    [{"K": 3.0}, {"fs": [1.0, 2.0]}, {"fs": "fast"}, {"fs": -5.0}, {"fs": 500.0, "dt": 0.1}],
)
def test_what_is_no_rate_or_two_is_none(numbers):
    assert rate_of(numbers) is None
