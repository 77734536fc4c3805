"""What is written to a trajectory file is read back to the last bit, with its units."""

import importlib.util
from dataclasses import replace

import numpy as np
import pytest

from rsea_core import (
    ActuatorModel,
    InputError,
    Load,
    PidTorque,
    Reference,
    Rig,
    simulate_closed_loop,
)
from rsea_core.effects import SpringCurve
from rsea_core.interop import netcdf_parquet as interop
from rsea_core.interop.netcdf_parquet import (
    read_netcdf,
    read_parquet,
    unit_of,
    write_netcdf,
    write_parquet,
)

needs_pyarrow = pytest.mark.skipif(
    importlib.util.find_spec("pyarrow") is None,
    reason='pyarrow is not installed (pip install "dftfs[interop]")',
)
needs_xarray = pytest.mark.skipif(
    importlib.util.find_spec("xarray") is None,
    reason='xarray is not installed (pip install "dftfs[interop]")',
)
FORMATS = [
    pytest.param(write_netcdf, read_netcdf, id="netcdf"),
    pytest.param(write_parquet, read_parquet, id="parquet", marks=needs_pyarrow),
]


@pytest.fixture(scope="module")
def trajectory():
    """A closed loop on a spring curve, on a rig whose name is not ASCII."""
    d = np.linspace(-0.3, 0.3, 13)
    curve = SpringCurve(deflection_rad=d, torque_Nm=60.0 * d + 90.0 * d**3)
    model = ActuatorModel(replace(Rig.preset("rsea-bench"), name="Prüfstand 2"), (curve,))
    reference = Reference(kind="sine", amplitude_Nm=3.0, frequency_Hz=1.3)
    return simulate_closed_loop(model, PidTorque(), reference, Load(kind="locked"), duration_s=0.37)


@pytest.mark.parametrize(("write", "read"), FORMATS)
def test_columns_come_back_bit_for_bit_with_units(trajectory, tmp_path, write, read):
    path = write(trajectory, tmp_path / "run.data")
    stored, columns = read(path), trajectory.columns()
    assert list(stored.columns) == list(columns)
    for name, values in columns.items():
        np.testing.assert_array_equal(stored.columns[name], values)
        assert stored.columns[name].dtype.kind == values.dtype.kind
        assert stored.columns[name].dtype.isnative
        assert not stored.columns[name].flags.writeable
    assert stored.units["time_s"] == "s"
    assert stored.units["reference_torque_Nm"] == "Nm"
    assert stored.units["motor_velocity_rad_per_s"] == "rad/s"
    assert stored.units["duty"] == "1"
    assert stored.units["joule_J"] == "J"
    assert [p.name for p in tmp_path.iterdir()] == ["run.data"]


@pytest.mark.parametrize(("write", "read"), FORMATS)
def test_machine_comes_back_as_text(trajectory, tmp_path, write, read):
    stored = read(write(trajectory, tmp_path / "run.data"))
    (tmp_path / "rig.toml").write_text(stored.attributes["rig"], encoding="utf-8")
    assert Rig.from_toml(tmp_path / "rig.toml") == trajectory.model.rig
    assert "term spring-curve at spring" in stored.attributes["equations"]
    assert stored.attributes["command_name"] == "duty"
    assert "locked" in stored.attributes["load"]


@pytest.mark.parametrize(("write", "read"), FORMATS)
def test_files_that_cannot_be_used_are_reported_in_one_line(trajectory, tmp_path, write, read):
    with pytest.raises(InputError, match=r"no\.data: cannot be read: No such file"):
        read(tmp_path / "no.data")
    other = tmp_path / "other.data"
    other.write_bytes(b"time_s,torque_Nm\n0,1\n" * 9)
    with pytest.raises(InputError, match=r"other\.data: is not a") as refused:
        read(other)
    assert "\n" not in str(refused.value)
    whole = write(trajectory, tmp_path / "whole.data").read_bytes()
    for share in (0.1, 0.6):
        other.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(InputError, match=r"other\.data: is not a") as refused:
            read(other)
        assert "\n" not in str(refused.value)
    with pytest.raises(InputError, match=r"run\.data: cannot be written"):
        write(trajectory, tmp_path / "nowhere" / "run.data")


@needs_xarray
def test_xarray_opens_the_netcdf_file_with_time_as_coordinate(trajectory, tmp_path):
    import xarray

    path = write_netcdf(trajectory, tmp_path / "run.nc")
    with xarray.open_dataset(path, engine="scipy") as data:
        assert list(data.coords) == ["time_s"]
        assert data["torque_Nm"].dims == ("time_s",)
        assert data["torque_Nm"].attrs["units"] == "Nm"
        row = data.sel(time_s=0.2, method="nearest")
        assert float(row["torque_Nm"]) == trajectory.torque_Nm[200]
        assert data["time_s"].dtype == np.float64  # seconds, not dates


@needs_pyarrow
def test_pandas_sees_the_parquet_columns(trajectory, tmp_path):
    pandas = pytest.importorskip("pandas", reason="pandas is not installed")
    frame = pandas.read_parquet(write_parquet(trajectory, tmp_path / "run.parquet"))
    np.testing.assert_array_equal(frame["torque_Nm"], trajectory.torque_Nm)


def test_parquet_without_pyarrow_names_the_extra(trajectory, tmp_path, monkeypatch):
    def missing(name):
        raise ModuleNotFoundError(f"No module named {name!r}")

    monkeypatch.setattr(interop.importlib, "import_module", missing)
    with pytest.raises(InputError, match=r'not installed: pip install "dftfs\[interop\]"'):
        write_parquet(trajectory, tmp_path / "run.parquet")


def test_netcdf_of_another_program_is_refused(tmp_path):
    path = tmp_path / "other.nc"
    with interop.netcdf_file(path, "w") as file:
        file.createDimension("x", 2)
        file.createVariable("x", np.float64, ("x",))[:] = [1.0, 2.0]
    with pytest.raises(InputError, match="is not a trajectory file"):
        read_netcdf(path)


def test_unit_is_the_longest_ending():
    assert unit_of("wheel_velocity_rad_per_s") == "rad/s"
    assert unit_of("torque_rate_Nm_per_s") == "Nm/s"
    assert unit_of("contact_s") == "s"
    assert unit_of("command_limited") == "1"
