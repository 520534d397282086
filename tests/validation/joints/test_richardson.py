"""Richardson's extrapolation and the grid convergence index, against the paper's example and exact power laws."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from validation.joints.checks.richardson import richardson


def test_example_of_celik():
    """Celik et al. 2008, Table 1, first column: 18 000, 8 000 and 4 500 cells in a plane."""
    sizes = (18_000**-0.5, 8_000**-0.5, 4_500**-0.5)
    found = richardson(sizes, (6.063, 5.972, 5.863))
    assert found.order == pytest.approx(1.53, abs=0.01)
    assert found.value == pytest.approx(6.1685, abs=1e-3)
    assert found.gci_percent == pytest.approx(2.2, abs=0.05)


@given(
    order=st.floats(0.5, 6.0),
    ratios=st.tuples(st.floats(1.2, 2.5), st.floats(1.2, 2.5)),
    slope=st.floats(0.01, 10.0) | st.floats(-10.0, -0.01),
)
def test_value_and_order_of_an_exact_power_law(order, ratios, slope):
    sizes = (0.1, 0.1 * ratios[0], 0.1 * ratios[0] * ratios[1])
    found = richardson(sizes, tuple(100 + slope * h**order for h in sizes))
    change = abs(slope) * (sizes[1] ** order - sizes[0] ** order)
    if change > 1e-5:  # below, rounding of the values dominates
        assert found.order == pytest.approx(order, rel=1e-4)
        assert found.value == pytest.approx(100.0, abs=1e-3 * change + 1e-9)


@pytest.mark.parametrize(
    ("sizes", "values", "reason"),
    [
        ((0.2, 0.1, 0.05), (1.0, 2.0, 3.0), "growing"),
        ((0.1, 0.2, 0.4), (1.0, 1.1, 1.0), "monotonic"),
        ((0.1, 0.2, 0.4), (1.0, 1.1, 1.1), "monotonic"),
        ((0.1, 0.2, 0.4), (1.0, 1.1, 1.15), "ratio"),
    ],
)
def test_error_says_why_there_is_no_order(sizes, values, reason):
    with pytest.raises(ValueError, match=reason):
        richardson(sizes, values)
