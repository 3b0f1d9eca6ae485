"""Cross-axis sensitivity: a sensor channel also reads a share of other channels, e.g. by sensing axes that are not
orthogonal.

    y_i = x_i + from_next x_(i+1) + from_after_next x_(i+2)        channels counted cyclically, shares without unit

An entry of `equalizer.effects.catalogue`.
"""

import numpy as np

from equalizer.effects.effect import Effect, OnResponse, Parameter, Values
from equalizer.effects.starts.evidence import Evidence
from equalizer.effects.starts.response_starts import fit_coefficients
from equalizer.signals.signal import FloatArray

SHARE_NAMES = ("from_next", "from_after_next")
"""Parameter names: share of the next channel, and of the channel after it, counted cyclically."""
MAX_SHARE = 1.0
"""Largest share of another channel. Chosen: a larger one indicates exchanged channels, a wiring error."""
MIN_SHARE = 1e-4
"""Largest share at or below which no starting values are returned. Chosen: a hundredth of the 1 % that accelerometer
data sheets allow."""


def _list_following_channels(channel: int, channel_count: int) -> list[int]:
    """List the indices of the channels that follow this one, cyclically: two, or fewer where there are not so many."""
    return [(channel + offset) % channel_count for offset in range(1, min(channel_count, 3))]


def _mix_channels(response: FloatArray, sample_rate_hz: float, channels: tuple[int, ...], values: Values) -> FloatArray:
    """Add the shares of the following channels to each of `channels` of the response (n, p); shares of channels that it
    does not have are ignored."""
    sensed_response = response.copy()
    for channel in channels:
        for name, source_channel in zip(
            SHARE_NAMES, _list_following_channels(channel, response.shape[1]), strict=False
        ):
            sensed_response[:, channel] += values[name] * response[:, source_channel]
    return sensed_response


def _find_starting_values(evidence: Evidence, channel: int) -> tuple[Values, ...]:
    """Find starting shares by linear regression of the channel's residual on the next one or two predicted channels and
    on its own prediction (an error of its gain). Empty for a single channel, and where the largest share is not between
    `MIN_SHARE` and `MAX_SHARE`; the share of a missing channel is 0."""
    source_channels = _list_following_channels(channel, evidence.response.shape[1])
    residual = evidence.response - evidence.predicted
    if not source_channels:
        return ()
    shares = fit_coefficients(residual[:, channel], evidence.predicted[:, [*source_channels, channel]], evidence.used)[
        : len(source_channels)
    ]
    if not MIN_SHARE < float(np.abs(shares).max()) < MAX_SHARE:
        return ()
    return ({**dict.fromkeys(SHARE_NAMES, 0.0), **dict(zip(SHARE_NAMES, shares.tolist(), strict=False))},)


EFFECT = Effect(
    name="cross_axis_sensitivity",
    equation="y_i = x_i + from_next x_(i+1) + from_after_next x_(i+2)",
    source="IEEE Std 1293, single-axis accelerometers: cross-axis sensitivity",
    signature="one channel contains a constant share of other channels at every frequency and level, and they "
    "contain no share of it, while the position agrees",
    parameters=tuple(
        Parameter(name, -MAX_SHARE, MAX_SHARE, none=0.0, scale="linear", step=1e-3) for name in SHARE_NAMES
    ),
    action=OnResponse(_mix_channels, stage=-1),
    starts=_find_starting_values,
    sites=("one", "each"),
    simpler=("sensor_misalignment",),
)
