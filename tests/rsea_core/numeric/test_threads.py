"""Threads: pieces of compiled work, and the library of linear algebra beside them."""

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from rsea_core.numeric.threads import on_one_blas_thread


def threads_of_openblas() -> list[int]:
    return [i["num_threads"] for i in threadpool_info() if i["internal_api"] == "openblas"]


def test_openblas_has_one_thread_inside_and_as_many_as_before_outside():
    np.linalg.inv(np.eye(2))
    with threadpool_limits(2, user_api="blas"):
        before = threads_of_openblas()
        if 2 not in before:
            pytest.skip("no OpenBLAS that takes two threads on this machine")
        within = on_one_blas_thread(threads_of_openblas)()
        assert within == [1] * len(before)
        assert threads_of_openblas() == before


def test_errors_pass_and_the_name_stays():
    @on_one_blas_thread
    def fails():
        raise ValueError("its own")

    assert fails.__name__ == "fails"
    with pytest.raises(ValueError, match="its own"):
        fails()
