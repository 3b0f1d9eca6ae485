import numpy as np
import pytest

from analysis.look.channels import list_channels
from analysis.look.clipping import check_clipping, count_clipped_samples

T = np.arange(20_000) / 1000


def make_signals():
    rng = np.random.default_rng(3)
    return {
        "sine": np.sin(2 * np.pi * 7.3 * T),
        "multisine": sum(np.sin(2 * np.pi * f * T + f**2) for f in (3.0, 7.0, 11.0, 17.0)),
        "noise": rng.standard_normal(len(T)),
    }


@pytest.mark.parametrize("name", ["sine", "multisine", "noise"])
@pytest.mark.parametrize("step", [0.0, 0.01, 0.05])
def test_what_was_cut_off_is_found_and_counted(name, step):
    samples = make_signals()[name]
    limit = 0.7 * samples.max()
    cut = np.minimum(samples, limit)
    cut = np.round(cut / step) * step if step else cut
    true = int(np.sum(cut >= cut.max() - 1e-12))
    assert count_clipped_samples(cut) == pytest.approx(true, rel=0.3)


@pytest.mark.parametrize("name", ["sine", "multisine", "noise"])
@pytest.mark.parametrize("step", [0.0, 0.01, 0.05, 0.2])
def test_a_signal_that_turns_by_itself_is_not_cut_off(name, step):
    samples = make_signals()[name]
    rounded = np.round(samples / step) * step if step else samples
    assert count_clipped_samples(rounded) == 0
    assert count_clipped_samples(-rounded) == 0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_peak_of_a_periodic_signal_is_not_cut_off_however_often_it_comes(seed):
    lines = np.arange(1, 200)
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(lines))
    period = np.cos(2 * np.pi * np.outer(np.arange(500) / 500, lines) + phases).sum(axis=1)
    assert count_clipped_samples(np.tile(period, 10)) == 0
    cut = np.minimum(period, 0.5 * period.max())
    assert count_clipped_samples(np.tile(cut, 10)) == 10 * np.sum(period >= cut.max())


def test_a_place_where_it_comes_to_rest_is_not_cut_off():
    """A coarse encoder at the end of each step of a square reference."""
    target = np.sign(np.sin(2 * np.pi * 0.5 * T))
    place = np.zeros_like(T)
    for k in range(1, len(T)):
        place[k] = place[k - 1] + 0.02 * (target[k] - place[k - 1])
    rounded = np.round(place / 0.003) * 0.003
    assert count_clipped_samples(rounded) == count_clipped_samples(-rounded) == 0


def test_a_clipped_sensor_is_wrong_and_a_limited_command_is_reported(make_recording):
    samples = make_signals()["noise"]
    found = check_clipping(list_channels(make_recording(np.clip(samples, -1, 1), np.clip(samples, -2, 9))))
    assert [(check.level, check.name) for check in found] == [("notice", "clipping"), ("wrong", "clipping")]
    assert found[0].finding.startswith("command 'f1' is cut off at 1 N and −1 N: ")
    assert found[1].finding.startswith("response 'a1' is cut off at −2 m/s^2: ")


def test_a_binary_command_is_meant_so(make_recording):
    binary = np.sign(make_signals()["noise"])
    found = check_clipping(list_channels(make_recording(binary, make_signals()["sine"])))
    assert [check.level for check in found] == ["fine"]
