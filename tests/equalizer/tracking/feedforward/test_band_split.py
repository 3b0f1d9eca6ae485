import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from equalizer.tracking.feedforward.band_split import BandEdges, CausalSplit, LinearPhaseSplit

RATE_HZ = 1000.0


def noise(samples=3000, seed=1):
    return np.random.default_rng(seed).standard_normal((samples, 3))


@pytest.mark.parametrize("edges", [BandEdges(), BandEdges(None, 36.0), BandEdges(4.0, None), BandEdges(None, None)])
def test_bands_of_linear_phase_add_up_to_the_input_their_latency_later(edges):
    split, wanted = LinearPhaseSplit(edges, RATE_HZ), noise()
    bands = split.split(wanted)
    late = np.zeros_like(bands.total)
    late[split.latency_samples : split.latency_samples + len(wanted)] = wanted
    assert np.abs(bands.total - late).max() <= 1e-12
    assert bands.latency_samples == split.latency_samples


@settings(max_examples=25, deadline=None)
@given(st.floats(0.5, 10.0), st.floats(20.0, 200.0), st.sampled_from([1, 3, 5]))
def test_causal_bands_add_up_to_the_input_at_once(low_hz, high_hz, order):
    wanted = noise(500)
    bands = CausalSplit(BandEdges(low_hz, high_hz), RATE_HZ, order).split(wanted)
    assert np.abs(bands.total - wanted).max() <= 1e-12


def test_no_causal_band_begins_before_its_input():
    wanted = noise()
    wanted[:1000] = 0
    bands = CausalSplit(BandEdges(), RATE_HZ).split(wanted)
    assert not np.stack([bands.low, bands.middle, bands.high])[:, :1000].any()


@pytest.mark.parametrize(("transition_hz", "latency_ms"), [(2.0, 907.0), (4.0, 454.0)])
def test_the_latency_of_linear_phase_follows_from_its_transition(transition_hz, latency_ms):
    assert LinearPhaseSplit(BandEdges(), RATE_HZ, transition_hz).latency_ms == pytest.approx(latency_ms)
    assert CausalSplit(BandEdges(), RATE_HZ).latency_ms == 0


def test_linear_phase_keeps_a_band_to_a_thousandth_and_without_phase():
    split = LinearPhaseSplit(BandEdges(), RATE_HZ)
    inside = split.compute_response(np.arange(5.0, 35.1, 0.25))
    assert np.abs(inside[:, 1] - 1).max() < 2e-3
    assert np.abs(inside[:, [0, 2]]).max() < 2e-3
    assert np.abs(split.compute_response(np.array([84.0, 300.0]))[:, :2]).max() < 1e-3


@pytest.mark.parametrize("order", [1, 3, 5])
def test_the_stated_response_of_the_causal_bands_is_what_an_impulse_shows(order):
    split = CausalSplit(BandEdges(), RATE_HZ, order)
    impulse = np.zeros((8192, 1))
    impulse[0] = 1
    bands = split.split(impulse)
    shown = np.fft.rfft(np.hstack([bands.low, bands.middle, bands.high]), axis=0)
    stated = split.compute_response(np.fft.rfftfreq(8192, 1 / RATE_HZ))
    assert np.abs(shown - stated).max() < 1e-9
    assert np.abs(stated.sum(axis=1) - 1).max() < 1e-12


def test_the_causal_middle_band_leads_below_its_centre_and_lags_above():
    phases = CausalSplit(BandEdges(), RATE_HZ).compute_phase_deg(np.array([4.0, 12.0, 36.0]))[:, 1]
    assert phases[0] > 20
    assert abs(phases[1]) < 3
    assert phases[2] < -20


def test_steeper_causal_bands_exceed_the_input_more():
    gains = [CausalSplit(BandEdges(), RATE_HZ, order).largest_gain for order in (1, 3, 5)]
    assert gains == pytest.approx([1.0, 1.457, 1.988], abs=2e-3)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: BandEdges(40.0, 36.0), "low_hz is 40, not below high_hz, 36"),
        (lambda: BandEdges(-1.0, 36.0), "low_hz is -1.0; it must be a positive number, or None"),
        (lambda: LinearPhaseSplit(BandEdges(), 60.0), "sample_rate_hz is 60.0; it must be above twice"),
        (lambda: LinearPhaseSplit(BandEdges(), RATE_HZ, 9.0), "transition_hz is 9.0; it must be positive and at most"),
        (lambda: CausalSplit(BandEdges(), RATE_HZ, 2), "order is 2; it must be odd and positive"),
    ],
)
def test_a_split_that_cannot_be_is_refused(make, said):
    with pytest.raises(ValueError, match=said):
        make()
