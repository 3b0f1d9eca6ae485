from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.localisation.mismatch_cells import Margin, Prediction, compute_mismatch_cells, learn_floor
from analysis.diagnosis.localisation.mismatch_maps import adjust_for_model_error, collect_model_error
from analysis.diagnosis.noise.noise_floor import estimate_noise_floor


def record_with_prediction(bench, seed=1):
    command, segments = bench.command(seed)
    return bench.recorded(seed), Prediction(*bench.linear(command, segments))


def find_cells(recording, prediction, **options):
    return compute_mismatch_cells(recording, prediction, estimate_noise_floor(recording), **options)


@pytest.mark.slow
def test_the_true_model_has_no_mismatch(device):
    found = [find_cells(*record_with_prediction(device(), seed)) for seed in range(12)]
    assert len(found[0]) > 100
    assert sum(any(cell.significant for cell in cells) for cells in found) <= 1


@pytest.mark.slow
def test_without_a_margin_false_alarms_come_at_the_stated_rate(device):
    cells = [
        cell
        for seed in range(6)
        for cell in find_cells(*record_with_prediction(device(position_noise=5e-6), seed), margin=Margin(0.0))
    ]
    assert 0.02 < np.mean([cell.p_value < 0.05 for cell in cells]) < 0.1


@pytest.mark.parametrize(("factor", "flagged"), [(1.01, False), (1.05, True)])
def test_one_per_cent_of_gain_is_within_the_margin_and_five_are_not(device, factor, flagged):
    recording, truth = record_with_prediction(device(noise=0.005))
    cells = find_cells(recording, Prediction(factor * truth.response, factor * truth.position), margin=Margin(0.02))
    assert any(cell.significant for cell in cells) is flagged
    if flagged:
        shares = [cell.share for cell in cells if cell.significant and cell.output == "a" + cell.input[1]]
        assert np.median(shares) == pytest.approx(0.05, rel=0.05)


def test_a_mismatch_in_one_band_of_one_channel_is_found_there_and_only_there(device):
    bench = device(noise=0.01)
    recording, truth = record_with_prediction(bench)
    at = np.arange(len(recording)) / 1000.0
    driven = recording.command.samples[:, 0] != 0
    off = truth.response.copy()
    off[:, 0] += np.where(driven, 0.5 * np.sin(2 * np.pi * 37 * at), 0.0)
    found = [cell for cell in find_cells(recording, Prediction(off, truth.position)) if cell.significant]
    assert {(cell.output, cell.input, cell.band_hz) for cell in found} == {("ax", "fx", (32.0, 64.0))}
    assert {cell.amplitude for cell in found} == {0.5, 1.0, 2.0}
    for cell in found:
        assert cell.rms == pytest.approx(0.5 / np.sqrt(2), rel=0.1)
        assert cell.in_noise > 5


def test_what_is_not_periodic_is_compared_in_windows(device):
    recording, truth = record_with_prediction(device(noise=0.02))
    swept = replace(recording, segments=tuple(replace(s, period=0, kind="sweep") for s in recording.segments))
    floor = estimate_noise_floor(recording)
    clean = compute_mismatch_cells(swept, truth, floor)
    assert len(clean) > 100
    assert not any(cell.significant for cell in clean)
    assert (
        0.01
        < np.mean([c.p_value < 0.05 for c in compute_mismatch_cells(swept, truth, floor, margin=Margin(0.0))])
        < 0.15
    )
    off = compute_mismatch_cells(swept, Prediction(1.1 * truth.response, truth.position), floor)
    assert {cell.quantity for cell in off if cell.significant} == {"acceleration"}
    own = [cell.share for cell in off if cell.significant and cell.output == "a" + cell.input[1]]
    assert np.median(own) == pytest.approx(0.1, rel=0.1)


def test_samples_that_do_not_count_are_left_out(device):
    recording, truth = record_with_prediction(device(noise=0.01))
    off = truth.response.copy()
    last = recording.segments[-1]
    off[last.start : last.stop] *= 1.5
    used = np.ones(len(recording), dtype=bool)
    prediction = Prediction(off, truth.position)
    assert any(cell.significant for cell in find_cells(recording, prediction, used=used))
    used[last.start : last.stop] = False
    assert not any(cell.significant for cell in find_cells(recording, prediction, used=used))


def test_a_floor_learned_from_clean_recordings_is_no_mismatch(device):
    bench = device(noise=0.005)
    pairs = [record_with_prediction(bench, seed) for seed in range(4)]
    cells = [find_cells(r, Prediction(1.06 * t.response, t.position)) for r, t in pairs]
    assert all(any(cell.significant for cell in each) for each in cells)
    learned = learn_floor(cells[:3])
    recording, truth = pairs[3]
    margin = Margin(learned=learned)
    same = find_cells(recording, Prediction(1.06 * truth.response, truth.position), margin=margin)
    assert not any(cell.significant for cell in same)
    worse = find_cells(recording, Prediction(1.2 * truth.response, truth.position), margin=margin)
    assert any(cell.significant for cell in worse)


def test_a_floor_knows_a_channel_by_its_other_inputs(device):
    cells = find_cells(*record_with_prediction(device()))
    floor = learn_floor([cells])
    one = cells[0]
    assert floor.get_share(one.output, one.quantity, "fw", one.band_hz) >= floor.get_share(
        one.output, one.quantity, one.input, one.band_hz
    )
    assert floor.get_share("aw", one.quantity, one.input, one.band_hz) == 0


def test_a_channel_that_is_exactly_zero_in_a_recording_differs_beyond_doubt(device):
    """No noise is measured there, and no ratio to it is a number that arithmetic cannot hold."""
    recording, truth = record_with_prediction(device())
    silent = recording.response.samples.copy()
    silent[:, 1] = 0.0
    with_silent = replace(recording, response=replace(recording.response, samples=silent))
    large = Prediction(1000.0 * truth.response, truth.position)
    cells = find_cells(with_silent, large)
    for cell in adjust_for_model_error(cells, collect_model_error(cells)):
        assert np.isfinite([cell.in_noise, cell.signal_in_noise, cell.p_value]).all()
    assert all(cell.p_value < 1e-9 for cell in cells if (cell.output, cell.quantity) == ("ay", "acceleration"))


def test_noise_that_is_not_known_gives_no_cells(device):
    recording, truth = record_with_prediction(device())
    unknown = replace(estimate_noise_floor(recording), method="unknown")
    assert compute_mismatch_cells(recording, truth, unknown) == ()


def test_predictions_of_another_shape_are_refused(device):
    recording, truth = record_with_prediction(device())
    with pytest.raises(ValueError, match=r"the predicted response must have shape \(27000, 2\), not \(10, 2\)"):
        find_cells(recording, Prediction(truth.response[:10]))
    with pytest.raises(ValueError, match=r"mask of used samples must have shape \(27000,\), not \(3,\)"):
        find_cells(recording, truth, used=np.ones(3, dtype=bool))


def test_the_answer_is_the_same_each_time_and_permutes_with_the_channels(device):
    recording, truth = record_with_prediction(device())
    off = Prediction(truth.response * [1.2, 1.0], truth.position)
    once = find_cells(recording, off)
    assert once == find_cells(recording, off)
    swapped = replace(
        recording,
        response=replace(recording.response, samples=recording.response.samples[:, ::-1], channels=("ay", "ax")),
    )
    turned = find_cells(swapped, Prediction(off.response[:, ::-1], truth.position))
    key = lambda cell: (cell.output, cell.quantity, cell.input, cell.band_hz, cell.amplitude)  # noqa: E731
    assert {key(c): c.significant for c in once} == {key(c): c.significant for c in turned}
