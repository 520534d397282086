"""Channels that are far quieter than the angle, by closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from made_fits import made

from validation.tracing.fitting.uncertainty import covariance


@pytest.mark.parametrize(
    ("size", "counted"), [(1.0, 800.0), (0.5, 400 * 1.25**2 / 1.0625), (1e-3, 400.0), (0.0, 400.0)]
)
def test_a_channel_counts_for_as_many_samples_as_its_errors_add_to_the_mean_square(size, counted):
    """Of n = 400 each, (1 + s^2)^2/(1 + s^4) n."""
    signs = (-1.0) ** np.arange(200)
    fit = made(
        [signs, signs], channels=[size * signs, size * signs], train=(np.arange(200) < 150, np.arange(200) < 150)
    )
    assert fit.variance_samples == pytest.approx(counted, rel=1e-5)
    assert (fit.samples, fit.train_samples, fit.angle_samples) == (800.0, 600.0, 400.0)  # models compare by all of them


def test_the_interval_of_a_constant_is_that_of_the_angle_alone_beside_a_channel_without_errors():
    """s^2 is that of the angle; with all samples counted its square root was 0.7 of it."""
    signs = (-1.0) ** np.arange(400)
    alone, both = made([signs], size=1), made([signs], channels=[0 * signs], size=1)
    quiet = replace(both, channels=both.channels._replace(jacobian=0 * both.channels.jacobian))
    assert covariance(quiet).matrix[0, 0] == pytest.approx(covariance(alone).matrix[0, 0], rel=5e-3)
