"""A log in another laboratory's dialect comes back as its recording, or is asked about."""

import numpy as np
import pytest

from benchmarks.foreign_dialects import DIALECTS, SERVO_RIG
from benchmarks.foreign_logs import imported
from tests.rsea_core.recordings.test_consistency_checks import RIG, recorded

LIBRARIES = {"lerobot": "pyarrow", "joint_states": "rosbags", "tdms_groups": "nptdms"}
ASKED = {  # nothing in these logs says it: a velocity in the servo's own unit, a joint's unit
    "dynamixel": "Present Velocity",
    "lerobot": "rad",
    "restarting": "duty",  # the jump between two runs hides the winding's law
}
ROWS = 2500


@pytest.mark.parametrize("dialect", DIALECTS, ids=lambda d: d.__name__)
def test_a_foreign_log_is_right_or_asked(dialect, tmp_path):
    pytest.importorskip(LIBRARIES.get(dialect.__name__, "numpy"))
    columns = {n: np.asarray(v)[:ROWS] for n, v in recorded().columns.items()}
    log = dialect(tmp_path, columns)
    rig = tmp_path / "own-rig.toml"
    rig.write_text(SERVO_RIG if log.is_servo else RIG.to_toml())
    verdict, line = imported(log, rig, tmp_path / "case")
    if dialect.__name__ in ASKED:
        assert verdict == "asked"
        assert ASKED[dialect.__name__] in line
    else:
        assert (verdict, line) == ("right", "")
