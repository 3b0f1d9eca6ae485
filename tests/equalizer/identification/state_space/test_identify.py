"""From a measured frequency response to a model: recovery, negative controls, and that it is always stable."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.identification.frequency_response.transfer_estimate import estimate_transfer
from equalizer.identification.state_space.candidates import choose_best
from equalizer.identification.state_space.identify import identify
from equalizer.identification.state_space.refusals import IdentificationError
from equalizer.identification.state_space.settings import IdentificationSettings

GRID = np.linspace(5, 35, 601)
QUICK = IdentificationSettings(draws=0, longer_horizons=(0,))


@pytest.fixture(scope="module")
def centre(plants):
    return plants.omega_like()


@pytest.fixture(scope="module")
def response(plants, measuring, centre):
    return measuring.swept(plants, centre, seed=1)


@pytest.fixture(scope="module")
def found(response):
    return identify(response)


@pytest.mark.slow
def test_the_device_is_found_from_noisy_sweeps_within_a_fifth_of_a_percent(plants, measuring, centre, found):
    rms, worst = measuring.errors_of(found.model, centre, GRID)
    assert rms < 0.002
    assert worst < 0.01
    assert measuring.held_out_error(plants, found.model, centre) < 0.002
    assert found.remarks == ()


def test_what_is_left_is_noise_and_the_model_knows_its_own_error(measuring, centre, found):
    assert found.cost == pytest.approx(1.0, abs=0.05)
    assert found.model.provenance["residual_over_noise"] == pytest.approx(np.sqrt(found.cost))
    true, _ = measuring.errors_of(found.model, centre, GRID)
    assert found.scatter == pytest.approx(true, rel=0.35)
    assert true <= found.expected_error < 3 * true  # with what the noise of the lines may hide


def test_no_pole_outlives_the_bound(found):
    assert found.model.spectral_radius <= np.exp(-1 / (0.5 * 1000)) * (1 + 1e-12)
    assert max(candidate.outside_gain for candidate in [found.chosen]) < 100


@pytest.mark.slow
def test_the_same_data_give_the_same_model(response):
    found, again = (identify(response, replace(QUICK, order=12, draws=3)) for _ in range(2))
    np.testing.assert_array_equal(again.model.parameters, found.model.parameters)
    np.testing.assert_array_equal(again.model.samples, found.model.samples)


def test_a_plant_of_low_order_is_recovered_to_rounding_from_exact_lines(plants, measuring):
    plant = measuring.small_plant(plants)
    found = identify(measuring.exact(plant, np.arange(5, 35, 0.1)), replace(QUICK, order=6))
    assert measuring.errors_of(found.model, plant, GRID)[0] < 1e-12
    true_poles = np.linalg.eigvals(plant.A)
    for pole in np.linalg.eigvals(found.model.A):
        assert np.abs(true_poles - pole).min() < 1e-10


def test_states_that_no_data_ask_for_do_no_harm(plants, measuring):
    plant = measuring.small_plant(plants)
    found = identify(measuring.exact(plant, np.arange(5, 35, 0.1)), replace(QUICK, order=10))
    assert measuring.errors_of(found.model, plant, GRID)[0] < 1e-8


def test_too_low_an_order_fits_worse_and_reports_it(measuring, centre, response):
    low = identify(response, replace(QUICK, order=8))
    assert measuring.errors_of(low.model, centre, GRID)[0] > 0.01
    assert any("order 8 may be too low" in remark for remark in low.remarks)


@pytest.mark.slow
def test_two_estimates_together_are_better_than_each(plants, measuring, centre, response):
    other = measuring.swept(plants, centre, 2, low_hz=1.0, high_hz=500.0, seconds=20.0)
    settings = replace(QUICK, order=20)
    alone, beside = identify(response, settings), identify(other, settings)
    both = identify((response, other), settings)
    assert both.lines == alone.lines + beside.lines
    errors = [measuring.errors_of(each.model, centre, GRID)[0] for each in (both, alone, beside)]
    assert errors[0] < min(errors[1:])


@pytest.mark.slow
def test_time_records_give_a_start_of_their_own(plants, measuring, synthetic, centre):
    recording = synthetic.sweeps(plants, 4.5, 37.0, 20.0, seed=4)
    settings = replace(QUICK, order=20)
    heard: list[float] = []
    found = identify(estimate_transfer([recording]), settings, (recording,), heard.append)
    assert [candidate.name for candidate in found.candidates] == [
        "warped subspace, horizon 10",
        "canonical variates, horizon 16",
    ]
    assert measuring.errors_of(found.model, centre, GRID)[0] < 0.002
    assert heard[0] == 0.0 and heard[-1] == 1.0 and heard == sorted(heard)


def test_records_of_something_else_are_refused(plants, synthetic, response):
    recording = synthetic.sweeps(plants, 4.5, 37.0, 5.0)
    with pytest.raises(IdentificationError, match="give the records that the response was estimated from"):
        identify(response, QUICK, (recording,))


def test_a_fit_by_cancellation_is_chosen_last_and_named(response, found):
    assert found.chosen.has_acceptable_gain
    wild = [replace(found.chosen, outside_gain=1e4, cost=0.1), found.chosen]
    assert choose_best(wild) is found.chosen
    assert choose_best(wild[:1]) is wild[0]
