import numpy as np
import pytest

from analysis.diagnosis.localisation.block_permutation import LEAST_P_VALUE, compute_correlation_time, shuffle_blocks
from analysis.diagnosis.localisation.state_regions import Disturbance, State, find_state_regions


def band_noise(random, n, low=2.0, high=20.0):
    spectrum = np.fft.rfft(random.standard_normal(n))
    hz = np.fft.rfftfreq(n, 1e-3)
    spectrum[(hz < low) | (hz > high)] = 0
    wave = np.fft.irfft(spectrum, n)
    return wave / wave.std()


def make_states(seed, n=24000):
    random = np.random.default_rng(seed)
    position = 3e-3 * band_noise(random, n)
    velocity = np.gradient(position) * 1000
    command = 1.5 * band_noise(random, n)
    strata = np.repeat([0, 1, 2], n // 3)
    states = [
        State("position", "x", "m", position),
        State("velocity", "v", "m/s", velocity),
        State("command", "fx", "N", command),
        State("time", "t", "s", np.arange(n) / 1000),
    ]
    return random, states, strata


def best_region(values, states, strata, **options):
    regions = find_state_regions(Disturbance(values, strata, **options), states, seed=1)
    return max(regions, key=lambda region: region.share)


def test_friction_follows_the_sign_of_velocity():
    random, states, strata = make_states(1)
    force = -0.2 * np.sign(states[1].values) + 0.05 * random.standard_normal(len(strata))
    region = best_region(force, states, strata)
    assert (region.description, region.criterion) == ("by the sign of v", "sign")
    assert region.share > 0.8
    assert region.p_value < 1e-3


def test_what_happens_at_reversals_sits_near_no_velocity():
    random, states, strata = make_states(2)
    slow = np.exp(-((states[1].values / 0.02) ** 2))
    region = best_region(slow * random.standard_normal(len(strata)), states, strata)
    assert (region.description, region.kind) == ("near v = 0", "velocity")
    assert region.p_value < 1e-3


def test_a_limit_sits_where_the_command_is_large():
    random, states, strata = make_states(3)
    u = states[2].values
    force = np.clip(u, -2, 2) - u + 0.02 * random.standard_normal(len(strata))
    words = {region.description for region in find_state_regions(Disturbance(force, strata), states, seed=1)}
    assert "where |fx| is large" in words


def test_a_place_is_named():
    random, states, strata = make_states(4)
    there = np.exp(-(((states[0].values - 2.1e-3) / 4e-4) ** 2))
    region = best_region(there * random.standard_normal(len(strata)), states, strata)
    assert region.description in ("near x = 2.1 mm", "near x = 2 mm", "near x = 2.2 mm")


@pytest.mark.parametrize(("strata_count", "words"), [(1, "late in the record"), (3, "late in each segment")])
def test_what_grows_with_time_is_late(strata_count, words):
    random, states, _ = make_states(5)
    strata = np.repeat(np.arange(strata_count), 24000 // strata_count)
    signal = band_noise(random, 24000)
    grown = signal * np.tile(np.linspace(0, 1, 24000 // strata_count), strata_count)
    regions = find_state_regions(Disturbance(grown, strata, signal), states, seed=1)
    assert words in {region.description for region in regions}


def test_noise_is_tied_to_nothing():
    p_values = []
    for seed in range(20):
        random, states, strata = make_states(100 + seed, 9000)
        noise = Disturbance(band_noise(random, 9000), strata, np.ones(9000))
        p_values += [region.p_value for region in find_state_regions(noise, states, seed=seed)]
    assert sum(p < 0.01 for p in p_values) <= 2


def test_levels_alone_are_no_state():
    random, states, strata = make_states(6)
    level = np.array([0.1, 1.0, 10.0])[strata]
    scaled = [State(s.kind, s.symbol, s.unit, s.values * level) for s in states]
    regions = find_state_regions(Disturbance(level * random.standard_normal(len(strata)), strata), scaled, seed=1)
    assert not [region for region in regions if region.p_value < 0.01]


def test_shuffled_velocity_explains_no_friction():
    random, states, strata = make_states(7)
    force = -0.2 * np.sign(np.roll(states[1].values, 12345)) + 0.05 * random.standard_normal(len(strata))
    assert not [r for r in find_state_regions(Disturbance(force, strata), states, seed=1) if r.p_value < 0.005]


def test_the_seed_decides_and_no_p_value_is_smaller_than_shuffles_can_say():
    _, states, strata = make_states(8)
    force = Disturbance(np.sign(states[1].values), strata)
    assert find_state_regions(force, states, seed=3) == find_state_regions(force, states, seed=3)
    assert min(region.p_value for region in find_state_regions(force, states, seed=3)) >= LEAST_P_VALUE


def test_too_little_or_nothing_has_no_regions():
    _, states, strata = make_states(9)
    assert find_state_regions(Disturbance(np.zeros(24000), strata), states, seed=1) == ()
    assert find_state_regions(Disturbance(np.ones(24000), -np.ones(24000, dtype=int)), states, seed=1) == ()


def test_a_state_of_another_length_is_refused():
    _, states, strata = make_states(10)
    with pytest.raises(ValueError, match=r"x has shape \(24000,\), not \(10,\)"):
        find_state_regions(Disturbance(np.ones(10), strata[:10]), states, seed=1)


def test_a_shuffle_keeps_each_sample_and_its_stratum():
    strata = np.repeat([0, 1, 4], [100, 57, 300])
    order = shuffle_blocks(strata, 9, np.random.default_rng(1))
    assert sorted(order) == list(range(457))
    assert (strata[order] == strata).all()


def test_a_correlation_time_is_that_of_an_autoregression():
    random = np.random.default_rng(11)
    steps = random.standard_normal(200_000)
    series = np.empty_like(steps)
    last = 0.0
    for k, step in enumerate(steps):
        last = series[k] = 0.9 * last + step
    # Sum over all lags of 0.81^|k|.
    assert compute_correlation_time(series) == pytest.approx((1 + 0.81) / (1 - 0.81), rel=0.15)
    assert compute_correlation_time(np.zeros(100)) == 1.0
