"""Recordings in the form in which they are compared: what is said of them."""

from dataclasses import replace

import numpy as np

from analysis.diagnosis.prepare_recordings import prepare_recordings
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal

RATE_HZ = 100.0


def record_repeats(seed: int) -> Recording:
    push = np.tile(np.random.default_rng(seed).standard_normal(400), 5)
    moved = np.convolve(push, 0.9 ** np.arange(80))[: len(push)]
    return Recording(
        "cart",
        Signal(push[:, None], RATE_HZ, "force", "N", ("fx",)),
        Signal(np.append(0.0, moved[:-1])[:, None], RATE_HZ, "position", "m", ("x",)),
    )


def test_recordings_are_called_by_their_names_with_any_characters():
    remarks = prepare_recordings(
        (record_repeats(1), record_repeats(2)), ("pull 1.5 N", "pull 2.5 N"), without_model=False
    ).remarks
    assert [remark.split(":")[0] for remark in remarks] == ["pull 1.5 N", "pull 2.5 N"]


def test_spikes_of_a_sensor_are_replaced_before_anything_is_compared():
    clean = record_repeats(3)
    samples = np.cumsum(clean.response.samples, axis=0)  # smooth enough for a spike to be none of the motion
    spiked = samples.copy()
    spiked[500:1500:250] += 500.0
    prepared = prepare_recordings(
        (replace(clean, response=replace(clean.response, samples=spiked)),), ("run",), without_model=True
    )
    assert prepared.remarks[0].endswith("replaced by interpolated values: 4 of x (0.2 %).")
    assert np.abs(prepared.recordings[0].response.samples - samples).max() < 20
