"""Work is counted within a limit alone, and what is left out because of it is known."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from rsea_core.numeric.work_limit import (
    count_work,
    limited_work,
    no_work_left,
    share_of_work,
    work_in_progress,
)


def test_work_is_counted_within_its_context_and_not_outside():
    count_work(5.0)
    assert not no_work_left()
    with limited_work(10.0) as work:
        count_work(4.0)
        assert not no_work_left()
        assert not work.curtailed
        count_work(6.0)
        assert no_work_left()
        assert work.curtailed
    assert work.done == 10.0
    assert not no_work_left()


def test_an_inner_limit_hides_the_outer_one_until_it_ends():
    with limited_work(1.0) as outer:
        with limited_work(float("inf")) as inner:
            count_work(100.0)
            assert not no_work_left()
        assert (outer.done, inner.done) == (0.0, 100.0)


def test_another_thread_sees_the_innermost_work_in_progress():
    assert work_in_progress() is None
    with limited_work(1.0) as outer, ThreadPoolExecutor(1) as pool:
        assert pool.submit(work_in_progress).result() is outer
        with limited_work(1.0) as inner:
            assert pool.submit(work_in_progress).result() is inner
        assert pool.submit(work_in_progress).result() is outer
    assert work_in_progress() is None


def test_an_error_ends_the_limit():
    with pytest.raises(ValueError, match="stop"), limited_work(0.0):
        raise ValueError("stop")
    assert not no_work_left()


def test_within_a_share_the_limit_is_that_share_and_the_whole_one_afterwards():
    with limited_work(9.0):
        with share_of_work(1 / 3):
            assert not no_work_left()
            count_work(4.0)
            assert no_work_left()
        assert not no_work_left()
        count_work(5.0)
        assert no_work_left()


def test_without_a_limit_a_share_of_it_is_none():
    with share_of_work(0.0):
        assert not no_work_left()
    with limited_work(float("inf")), share_of_work(0.5):
        count_work(1e12)
        assert not no_work_left()


@pytest.mark.parametrize("strict", [False, True])
def test_only_a_strict_limit_ends_what_has_begun(strict):
    with limited_work(1.0, strict=strict) as work:
        assert not no_work_left(begun=True)
        count_work(1.0)
        assert no_work_left(begun=True) is strict
        assert work.curtailed is strict
        assert no_work_left()
