"""Progress that says that a long search goes on, and ends with it."""

import threading

from dftfs.cli.progress_lines import still_working
from rsea_core.numeric.work_limit import count_work, limited_work


def test_a_search_without_messages_is_reported_with_its_work_until_it_ends():
    reported, heard = [], threading.Event()

    def say(message: str) -> None:
        reported.append(message)
        heard.set()

    with limited_work(100.0):
        count_work(25.0)
        with still_working(say, seconds=0.01):
            assert heard.wait(10.0)
        count = len(reported)
        heard.clear()
        assert not heard.wait(0.05)
    assert set(reported) == {"searching: 25 of at most 1e+02 rows simulated"}
    assert len(reported) == count
