"""Pictures of a look: what is drawn is what is in the recording."""

import numpy as np

from analysis.figures.look_pictures import compute_envelope, make_look_pictures
from analysis.look.overview import make_overview
from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal

RATE_HZ = 100.0


def test_an_envelope_holds_every_sample_and_leaves_gaps():
    samples = np.random.default_rng(1).standard_normal(5000)
    samples[1000:1200] = np.nan
    times_s, low, high = compute_envelope(samples, RATE_HZ, 250)
    assert len(times_s) == 250
    column = (np.arange(5000) // 20)[np.isfinite(samples)]
    known = samples[np.isfinite(samples)]
    assert (low[column] <= known).all()
    assert (high[column] >= known).all()
    assert (np.nanmin(low), np.nanmax(high)) == (known.min(), known.max())
    assert np.isnan(low[52:58]).all()


def test_a_derivative_is_drawn_within_one_part():
    """Between parts the position jumps, and its derivative would hide all else."""
    times_s = np.arange(4000) / RATE_HZ
    speed = np.concatenate([np.sin(2 * times_s[:2000]), 3 * np.sin(2 * times_s[:2000])])
    place = np.concatenate([np.cumsum(speed[:2000]), 500 + np.cumsum(speed[2000:])]) / RATE_HZ

    def signal(samples, quantity, unit, name):
        return Signal(samples[:, None], RATE_HZ, quantity, unit, (name,))

    parts = [{"start": 0, "stop": 2000}, {"start": 2000, "stop": 4000}]
    recording = Recording(
        "rig",
        signal(np.random.default_rng(1).standard_normal(4000), "force", "N", "fx"),
        signal(speed, "velocity", "m/s", "vx"),
        position=signal(place, "position", "m", "x"),
        meta={"parts": parts},
    )
    (picture,) = (
        picture for picture in make_look_pictures(make_overview("r", recording), 1) if "derivatives" in picture.name
    )
    recorded, differences = (line.get_ydata() for line in picture.figure.axes[0].get_lines())
    assert np.nanmax(np.abs(recorded)) > 2.9
    assert np.nanmax(np.abs(differences)) < 3.2
