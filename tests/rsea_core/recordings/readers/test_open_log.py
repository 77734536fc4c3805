"""Every format gives the same numbers; what cannot be read safely is refused in one line."""

import pickle
import zipfile

import numpy as np
import pytest
from scipy.io import savemat

from rsea_core.errors import RecordingError
from rsea_core.recordings.readers.open_log import open_log
from tests.cases.logs import COLUMNS, write_csv, write_format

LIBRARIES = {
    "h5": "h5py", "mat73": "h5py", "parquet": "pyarrow", "mcap": "mcap", "tdms": "nptdms",
    "bag": "rosbags", "rosbag2": "rosbags",
}  # fmt: skip


@pytest.mark.parametrize("kind", ["mat", "mat73", "h5", "parquet", "npz", "mcap", "tdms"])
def test_a_format_gives_the_numbers_that_were_written(kind, tmp_path):
    pytest.importorskip(LIBRARIES.get(kind, "numpy"))
    stream = open_log(write_format(tmp_path, kind)).streams[0]
    for name, values in COLUMNS.items():
        assert np.array_equal(stream.columns[name], values)


@pytest.mark.parametrize("kind", ["bag", "rosbag2"])
def test_joint_states_of_a_bag_are_columns_by_joint(kind, tmp_path):
    pytest.importorskip("rosbags")
    stream = open_log(write_format(tmp_path, kind)).streams[0]
    assert stream.name == "/joint_states"
    assert np.array_equal(stream.columns["position[elbow]"], COLUMNS["pos"])
    assert np.allclose(stream.columns["header.stamp"], 1e-3 * COLUMNS["t"], atol=1e-9)


@pytest.mark.parametrize(
    ("delimiter", "decimal", "encoding", "units"),
    [
        (",", ".", "utf-8", False), (";", ",", "utf-8", False), (";", ".", "utf-8-sig", True),
        ("\t", ",", "utf-16", True), ("|", ".", "utf-8", True), (" ", ".", "cp1252", False),
    ],
)  # fmt: skip
def test_a_dialect_of_csv_gives_the_numbers_that_were_written(
    delimiter, decimal, encoding, units, tmp_path
):
    path = write_csv(
        tmp_path / "log.csv", delimiter=delimiter, decimal=decimal, encoding=encoding, units=units
    )
    stream = open_log(path).streams[0]
    for name, values in COLUMNS.items():
        assert np.allclose(stream.columns[name], values, rtol=1e-15, atol=0.0)
    assert dict(stream.units) == ({"t": "ms", "cmd": "%", "pos": "deg"} if units else {})


def test_lists_dates_and_flags_in_cells_are_numbers_and_other_text_is_named(tmp_path):
    rows = [f'CONTROL,2024-01-01T00:00:0{k}Z,"[{k}.5, 2]",{k % 2 == 1}' for k in range(9)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["type,when,goals,on", *rows]))
    stream = open_log(path).streams[0]
    assert stream.text == ("type",)
    assert list(stream.columns["when"]) == list(range(9))
    assert list(stream.columns["goals[0]"]) == [k + 0.5 for k in range(9)]
    assert list(stream.columns["on"]) == [0, 1] * 4 + [0]


@pytest.mark.parametrize("name", ["log.pkl", "log.pt", "log.csv"])
def test_a_pickle_is_refused_under_any_name(name, tmp_path):
    (tmp_path / name).write_bytes(pickle.dumps({"a": 1}, protocol=4))
    with pytest.raises(RecordingError, match="is a pickle"):
        open_log(tmp_path / name)
    np.save(tmp_path / "objects.npy", np.array([{}], dtype=object), allow_pickle=True)
    with pytest.raises(RecordingError, match="pickled objects"):
        open_log(tmp_path / "objects.npy")


@pytest.mark.parametrize("kind", ["mat", "h5", "parquet", "npz", "mcap", "tdms", "bag"])
def test_half_a_file_is_one_line(kind, tmp_path):
    pytest.importorskip(LIBRARIES.get(kind, "numpy"))
    path = write_format(tmp_path, kind)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(RecordingError) as found:
        open_log(path)
    assert "\n" not in str(found.value)


def test_a_csv_that_is_cut_off_in_its_last_row_says_so(tmp_path):
    path = write_csv(tmp_path / "log.csv")
    path.write_text(path.read_text()[: -len("1.0,2.0,3.0") * 3].rpartition(",")[0])
    with pytest.raises(RecordingError, match="the file is cut off"):
        open_log(path)


def test_a_stump_of_a_matlab_header_is_refused_at_once(tmp_path):
    (tmp_path / "log.mat").write_bytes(b"MATLAB 5.0 junk")
    with pytest.raises(RecordingError, match="shorter than its header"):
        open_log(tmp_path / "log.mat")


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("log.csv.gz", b"\x1f\x8b\x08\0\0", "is packed by gzip: unpack it"),
        ("log.xls", b"\xd0\xcf\x11\xe0\xa1\xb1", "is a workbook of Excel"),
        ("log.zip", None, "is a zip archive without NumPy arrays"),
        ("log.xlsx", None, "is a workbook of a spreadsheet"),
    ],
)
def test_a_packed_log_says_what_it_is(name, content, says, tmp_path):
    path = tmp_path / name
    if content is None:
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("log.csv", "t,x\n1,2\n")
    else:
        path.write_bytes(content)
    with pytest.raises(RecordingError, match=says):
        open_log(path)


@pytest.mark.parametrize("kind", ["npz", "mat", "h5"])
def test_a_matrix_takes_the_names_that_lie_next_to_it(kind, tmp_path):
    path = tmp_path / f"log.{kind}"
    matrix = np.stack(list(COLUMNS.values()), axis=1)
    if kind == "npz":
        np.savez(path, data=matrix, columns=np.array(list(COLUMNS)))
    elif kind == "mat":
        names = np.array(list(COLUMNS), dtype=object)
        savemat(path, {"data": matrix, "names": names})
    else:
        h5py = pytest.importorskip("h5py")
        with h5py.File(path, "w") as file:
            file["values"], file["items"] = matrix, [n.encode() for n in COLUMNS]
    assert list(open_log(path).streams[0].columns) == list(COLUMNS)


def test_groups_of_different_rates_with_a_clock_each_are_streams(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "log.h5", "w") as file:
        for name, rows in (("fast", 100), ("slow", 10)):
            file[f"run/{name}/time"] = np.arange(rows) / rows
            file[f"run/{name}/{name}_iq"] = np.arange(rows)
    streams = open_log(tmp_path / "log.h5").streams
    assert [(s.name, list(s.columns)) for s in streams] == [
        ("run/fast", ["fast_iq", "time"]), ("run/slow", ["slow_iq", "time"]),
    ]  # fmt: skip


def test_structs_of_parquet_are_columns_by_their_path(tmp_path):
    arrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    cells = [{"pos": float(k), "drive": {"iq": 2.0 * k}} for k in range(5)]
    parquet.write_table(arrow.table({"motor": cells}), tmp_path / "log.parquet")
    columns = open_log(tmp_path / "log.parquet").streams[0].columns
    assert set(columns) == {"motor.pos", "motor.drive.iq"}


def _matlab_73(path, write):
    """A file as MATLAB 7.3 writes it: a struct array is a dataset of references per field."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        refs = file.create_group("#refs#")

        def kept(values, kind):
            item = refs.create_dataset(f"r{len(refs)}", data=values)
            item.attrs["MATLAB_class"] = np.bytes_(kind)
            return item.ref

        write(file, kept)
        file.attrs["written"] = 1


def test_a_struct_array_of_matlab_73_is_read_by_the_labels_of_its_elements(tmp_path):
    def write(file, kept):
        h5py = pytest.importorskip("h5py")
        file["out/time"] = COLUMNS["t"][None, :]
        text = file.create_dataset(
            "comment", data=np.frombuffer("third run".encode("utf-16-le"), "<u2")
        )
        text.attrs["MATLAB_class"] = np.bytes_("char")
        for field, kind in (("values", "double"), ("label", "char")):
            own = [COLUMNS[n][None, :] if kind == "double" else [[ord(c)] for c in n]
                   for n in ("cmd", "pos")]  # fmt: skip
            refs = np.array([[kept(np.asarray(x, float if kind == "double" else "<u2"), kind)
                              for x in own]], dtype=h5py.ref_dtype)  # fmt: skip
            file.create_dataset(f"out/signals/{field}", data=refs, dtype=h5py.ref_dtype)

    _matlab_73(tmp_path / "log.mat", write)
    (stream,) = open_log(tmp_path / "log.mat").streams
    assert sorted(stream.columns) == [
        "out/signals/cmd/values", "out/signals/pos/values", "out/time"
    ]  # fmt: skip
    np.testing.assert_array_equal(stream.columns["out/signals/pos/values"], COLUMNS["pos"])


def test_a_table_of_matlab_is_refused_with_the_line_that_saves_it(tmp_path):
    def write(file, kept):
        table = file.create_dataset("T", data=np.arange(6, dtype="u4")[None, :])
        table.attrs["MATLAB_class"] = np.bytes_("table")
        table.attrs["MATLAB_object_decode"] = 3

    _matlab_73(tmp_path / "log.mat", write)
    with pytest.raises(RecordingError, match=r"T: tables .*table2struct\(T, 'ToScalar', true\)"):
        open_log(tmp_path / "log.mat")


def test_references_without_end_are_one_line(tmp_path):
    def write(file, kept):
        h5py = pytest.importorskip("h5py")
        own = file.create_dataset("a", (1, 2), dtype=h5py.ref_dtype)
        own[0, :] = [own.ref, own.ref]

    _matlab_73(tmp_path / "log.mat", write)
    with pytest.raises(RecordingError, match="refers to too many datasets"):
        open_log(tmp_path / "log.mat")
