"""What a result can do without: a failure is a line, Ctrl-C passes."""

import pytest

from hysteresis.attempts import attempt
from hysteresis.files import RecordError
from hysteresis.messages import failure


def test_a_failure_is_a_line_and_something_is_given_in_its_place():
    failed = []
    assert attempt("no page", lambda: 7, None, failed) == 7
    assert attempt("no page", lambda: 1 / 0, None, failed) is None
    assert failed == ["no page: ZeroDivisionError: division by zero"]


def test_ctrl_c_passes():
    def stopped():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        attempt("no page", stopped, None, [])


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (RuntimeError("two\nlines"), "RuntimeError: two"),
        (ValueError(""), "ValueError"),
        (KeyError("x"), "KeyError: 'x'"),
        (RecordError("a.csv: empty: expected rows"), "a.csv: empty: expected rows"),  # of this project: it says all
    ],
)
def test_an_error_in_one_line(error, line):
    assert failure(error) == line
