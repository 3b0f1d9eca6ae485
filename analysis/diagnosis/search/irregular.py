"""Whether a response is irregular: what should repeat does not, by far more than its noise; or it is full of peaks."""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.data.channel_noise import ChannelNoise
from analysis.diagnosis.data.noise_floor import NoiseFloor
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.rivalry import Arena

VARIES = 3.0
"""Rms between periods, over the noise."""
PEAKED = 10.0
"""Kurtosis of what is left, where nothing repeats; 3 for noise."""


def irregular(arena: Arena, found: Explanation, floors: Sequence[NoiseFloor]) -> bool:
    if any(one.how == "repeats" for one in floors):
        return any(_varies(channel) for one in floors for channel in (one.response, one.position) if channel)
    masks = [record.fit | record.choose for record in arena.whole.records]
    left = np.vstack([row[mask] for row, mask in zip(found.retuned.fitted.residuals, masks, strict=True)])
    if not len(left):
        return False
    left = left - left.mean(axis=0)
    power = np.mean(left**2, axis=0)
    return bool(np.any(np.mean(left**4, axis=0) > PEAKED * np.maximum(power, np.finfo(float).tiny) ** 2))


def _varies(noise: ChannelNoise) -> bool:
    return any(bool(np.any(one.variance > (VARIES * noise.rms) ** 2)) for one in noise.segments)
