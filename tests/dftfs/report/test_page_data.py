"""A page drawn again from the data beside it is the first one, and the data run nothing."""

import io
import json

import numpy as np
import pytest

from dftfs.cli.main import main
from dftfs.report.diagnosis.render import write_diagnosis_report
from dftfs.report.page_data import SUFFIX, PageDataError, draw_again, pack, unpack, write_page
from tests.cases.diagnosis_page import example_page


def test_a_diagnosis_page_is_drawn_again_as_it_was(tmp_path, capsys):
    page = write_diagnosis_report(example_page(), tmp_path / "report.html")
    first = page.read_text(encoding="utf-8")
    page.write_text("lost", encoding="utf-8")
    assert main(["report", str(tmp_path)]) == 0
    assert page.read_text(encoding="utf-8") == first
    assert capsys.readouterr().out == f"{page}\n"


def test_a_page_of_recordings_is_drawn_again_as_it_was(tmp_path):
    time = np.arange(300) * 1e-3
    page = write_page(
        tmp_path / "doctor.html",
        "recordings",
        title="a<b>",
        head=("column", "span"),
        rows=[("torque_Nm", 1.5)],
        notes=["one"],
        recordings=[("r.csv", time, {"torque_Nm": np.sin(9 * time)})],
        facts=(("Made", "now"),),
    )
    elsewhere = tmp_path / "elsewhere"
    assert main(["report", str(tmp_path), "--out", str(elsewhere)]) == 0
    assert (elsewhere / "doctor.html").read_bytes() == page.read_bytes()
    assert "torque (Nm)" in page.read_text(encoding="utf-8")


def test_values_come_back_as_they_were():
    shared = np.arange(4.0)
    given = {"a": (1, 2.5, None, "x"), "b": [shared, shared], 3: {"c": float("inf"), "d": 1 + 2j}}
    found = unpack(pack(given))
    assert found["a"] == given["a"]
    assert found[3] == given[3]
    np.testing.assert_array_equal(found["b"][0], shared)
    assert found["b"][0] is found["b"][1]


def test_of_a_record_of_the_user_the_values_come_back():
    class Law:
        def __init__(self):
            self.kp, self.step = 40.0, print

    found = unpack(pack({"law": Law()}))["law"]
    assert vars(found) == {"kp": 40.0, "step": None}


def archive(tree: object) -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, tree=np.frombuffer(json.dumps(tree).encode(), dtype=np.uint8))
    return stream.getvalue()


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"PK\x03\x04",
        archive({"class": "subprocess:Popen", "fields": {}}),
        archive({"class": "dftfs.files:subprocess.Popen", "fields": {}}),
        archive({"class": "dftfs.cli.main:main", "fields": {}}),
        archive(
            {"mapping": [["kind", "unknown"], ["page", "p.html"], ["values", {"mapping": []}]]}
        ),
        archive({"array": 7}),
    ],
)
def test_a_damaged_or_foreign_file_is_one_line(content, tmp_path, capsys):
    (tmp_path / f"report{SUFFIX}").write_bytes(content)
    with pytest.raises(PageDataError, match="is damaged, or its records"):
        draw_again(tmp_path / f"report{SUFFIX}", tmp_path)
    assert main(["report", str(tmp_path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not list(tmp_path.glob("*.html"))


def test_a_folder_without_pages_is_refused_by_name(tmp_path, capsys):
    assert main(["report", str(tmp_path)]) == 2
    assert main(["report", str(tmp_path / "none")]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert "has no data of a page" in lines[0]
    assert "is no folder" in lines[1]
