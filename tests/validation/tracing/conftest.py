"""Shared fixtures of the tracer."""

import pytest

from validation.tracing import trace_records


@pytest.fixture(autouse=True, scope="session")
def _one_thread():
    """Each worker of the tests has one core: a second thread would wait for it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(trace_records.__kwdefaults__, "threads", 1)
        yield
