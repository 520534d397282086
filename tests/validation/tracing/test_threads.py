"""Threads that are kept between fits."""

from __future__ import annotations

import os
import threading
import time

import pytest
from forked import alone_in_fork

from validation.tracing import threads
from validation.tracing.threads import in_threads


def test_results_are_in_order_whoever_is_first():
    def slow_first(item: int) -> int:
        time.sleep(0.05 if item == 0 else 0.0)
        return 10 * item

    assert in_threads(slow_first, [0, 1, 2, 3], 2) == [0, 10, 20, 30]


def test_items_run_at_the_same_time_in_threads_that_are_kept():
    together = threading.Barrier(2, timeout=10)

    def meet(item: int) -> int:
        together.wait()
        return threading.get_ident()

    first, second = in_threads(meet, [0, 1], 2), in_threads(meet, [0, 1], 2)
    assert len(set(first)) == 2
    assert set(first) == set(second)
    assert threading.get_ident() not in first


@pytest.mark.parametrize(("items", "count"), [([1], 2), ([1, 2], 1), ([], 2)])
def test_without_anything_to_share_the_caller_does_it(items, count):
    assert set(in_threads(lambda item: threading.get_ident(), items, count)) <= {threading.get_ident()}


def test_the_first_item_that_fails_is_the_error():
    def failing(item: int) -> int:
        if item:
            raise ValueError(f"item {item}")
        return item

    with pytest.raises(ValueError, match="item 1"):
        in_threads(failing, [0, 1, 2], 2)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_forked_process_starts_threads_of_its_own():
    """A pool that is inherited has no threads, and would wait for them for ever."""
    in_threads(abs, [-1, -2], 2)
    child = os.fork()
    if child == 0:  # pragma: no cover
        try:
            alone_in_fork()
            os._exit(0 if in_threads(abs, [-1, -2], 2) == [1, 2] else 2)
        finally:
            os._exit(1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    assert threads._pool(2) is threads._pool(2)
