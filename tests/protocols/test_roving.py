"""Levels that vary at random: how strong a stimulus is must not tell its direction."""

from dataclasses import replace

import numpy as np
import pytest

from protocols.definition.preparation import DemoSettings, PracticeSettings
from protocols.document.hashing import hash_protocol
from protocols.document.loading import ProtocolError, load_protocol
from protocols.procedure.schedule import draw_demo_level_n, draw_practice_level_n, draw_trial, rove_level_n
from protocols.procedure.staircase import to_db

ROVED = PracticeSettings(frequencies_hz=(25.0,), level_n=2.0, rove_db=6.0)
TRIALS = [(seed, trial) for seed in range(40) for trial in range(50)]


@pytest.fixture
def drawn(small_protocol):
    """(levels in dB re 2 N, directions) of many practice trials."""
    levels = [to_db(draw_practice_level_n(ROVED, seed, 1, trial, 0) / 2.0) for seed, trial in TRIALS]
    schedule = small_protocol.schedule
    sides = [draw_trial(schedule, "random", seed, 1, trial, 0).direction for seed, trial in TRIALS]
    return np.array(levels), np.array(sides)


def test_levels_are_even_in_db_over_the_stated_range(drawn):
    levels, _ = drawn
    assert -3.0 <= levels.min() < -2.95
    assert 2.95 < levels.max() <= 3.0
    counts = np.histogram(levels, bins=6, range=(-3, 3))[0]
    assert np.abs(counts - len(levels) / 6).max() < 4 * np.sqrt(len(levels) * 5 / 36)


def test_a_level_tells_nothing_about_the_direction(drawn):
    levels, sides = drawn
    error = 6 / np.sqrt(12) * np.sqrt(4 / len(levels))
    assert abs(levels[sides == 1].mean() - levels[sides == 2].mean()) < 4 * error


@pytest.mark.parametrize(("difference_db", "share"), [(0.5, 0.5417), (1.0, 0.5833), (3.0, 0.75)])
def test_who_goes_by_strength_alone_is_right_as_seldom_as_the_protocol_says(drawn, difference_db, share):
    """The best criterion on felt strength, when direction 1 comes out so much stronger; perfect without roving."""
    levels, sides = drawn
    felt = levels + np.where(sides == 1, 0.5, -0.5) * difference_db
    best = max(np.mean((felt > criterion) == (sides == 1)) for criterion in np.linspace(-5, 5, 201))
    assert best == pytest.approx(share, abs=0.035)
    fixed = felt - levels
    assert np.mean((fixed > 0) == (sides == 1)) == 1.0


def test_demonstrations_vary_too_and_a_width_of_0_is_one_level():
    demo = DemoSettings(level_n=2.0, rove_db=6.0)
    levels = {draw_demo_level_n(demo, 7, played) for played in range(20)}
    assert len(levels) == 20
    assert 1.41 < min(levels) < max(levels) < 2.83
    assert {draw_demo_level_n(replace(demo, rove_db=0.0), 7, played) for played in range(20)} == {2.0}
    assert draw_practice_level_n(replace(ROVED, rove_db=0.0), 7, 1, 3, 0) == 2.0


@pytest.mark.parametrize("table", ["demo", "practice"])
def test_the_strongest_level_of_the_range_stays_within_the_cap(small_text, table):
    frequencies = "frequencies_hz = [25.0]\n" if table == "practice" else ""
    with pytest.raises(ProtocolError, match=rf"{table}.level_n is 3.0\d+ N, with its rove_db"):
        load_protocol(f"{small_text}\n[{table}]\n{frequencies}level_n = 2.0\nrove_db = 7.2\n", "mine.toml")
    load_protocol(f"{small_text}\n[{table}]\n{frequencies}level_n = 2.0\nrove_db = 7.0\n", "mine.toml")


def test_shipped_studies_vary_the_level(shipped):
    assert (shipped.practice.rove_db, shipped.demo.rove_db) == (6.0, 6.0)


@pytest.fixture(params=["direction_threshold", "equalized_threshold"])
def shipped(request):
    from study.store.formats.protocol_files import read_study_protocol

    return read_study_protocol(request.param).protocol


def test_staircase_trials_are_roved_around_the_staircases_level_for_both_directions_alike(small_protocol):
    places = [(seed, trial) for seed in range(40) for trial in range(50)]
    levels = np.array([to_db(rove_level_n(1.2, 6.0, seed, 2, trial, 0) / 1.2) for seed, trial in places])
    sides = [draw_trial(small_protocol.schedule, "random", seed, 2, trial, 0).direction for seed, trial in places]
    assert -3.0 <= levels.min() < -2.9 and 2.9 < levels.max() <= 3.0
    assert abs(np.corrcoef(levels, sides)[0, 1]) < 4 / np.sqrt(len(levels))
    assert rove_level_n(1.2, 0.0, 7, 2, 3, 0) == 1.2
    assert len({rove_level_n(1.2, 6.0, 7, 2, 3, attempt) for attempt in range(5)}) == 5


def roved(text, rove_db, cap_n):
    changed = text.replace("fade_in_s = 0.1", f"fade_in_s = 0.1\nrove_db = {rove_db}")
    return changed.replace("cap_n = 3.0\nup", f"cap_n = {cap_n}\nup")


@pytest.mark.parametrize(
    ("rove_db", "cap_n", "highest_n"), [(6.0, 3.0, "2.123"), (6.0, 2.13, "2.123"), (0.1, 3.0, "2.982")]
)
def test_a_range_that_would_pass_the_force_cap_is_refused_with_the_cap_that_would_do(
    small_text, rove_db, cap_n, highest_n
):
    with pytest.raises(ProtocolError, match=rf"staircase.cap_n is {cap_n:g} N, .* at most {highest_n} N"):
        load_protocol(roved(small_text, rove_db, cap_n), "mine.toml")
    load_protocol(roved(small_text, rove_db, highest_n), "mine.toml")


def test_roving_counts_in_the_fingerprint_only_where_it_is_used(small_text):
    plain = hash_protocol(load_protocol(small_text, "mine.toml"))
    assert hash_protocol(load_protocol(roved(small_text, 0.0, 3.0), "mine.toml")) == plain
    lower = small_text.replace("cap_n = 3.0\nup", "cap_n = 2.0\nup")
    with_range = hash_protocol(load_protocol(roved(small_text, 6.0, 2.0), "mine.toml"))
    assert with_range != hash_protocol(load_protocol(lower, "mine.toml"))


def test_shipped_studies_play_the_staircases_level(shipped):
    assert shipped.stimulus.rove_db == 0.0


def test_a_level_roved_to_the_cap_but_for_rounding_is_taken(small_text):
    level_n = 3.0 * 10 ** (-6.0 / 40) * (1 + 1e-12)
    load_protocol(f"{small_text}\n[demo]\nlevel_n = {level_n!r}\nrove_db = 6.0\n", "mine.toml")
