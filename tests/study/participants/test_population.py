"""Simulated people: thresholds that rise as in the published figure, and a study of ten that shows it."""

from collections.abc import Callable
from functools import cache
from importlib.resources import files

import numpy as np
import pytest
from scipy.stats import tukey_hsd

from protocols.definition.study_protocol import StudyProtocol
from protocols.document.loading import load_protocol
from protocols.procedure.schedule import draw_trial, schedule_runs
from protocols.procedure.staircase import begin_staircase, compute_level_n, is_finished, step, to_newton
from protocols.trial import Phase
from study.participants.detection_thresholds import TYPICAL_DETECTION_N
from study.participants.direction_feeler import DirectionFeeler
from study.participants.observer import Observer, PerceivedStimulus
from study.participants.observer_catalogue import find_observer
from study.participants.population import draw_person
from tests.slow_instances import slow_after

FREQUENCIES = (5.0, 15.0, 25.0, 35.0, 45.0)


def draw_population(count: int, seed: int) -> tuple[DirectionFeeler, ...]:
    return tuple(draw_person(number, seed) for number in range(1, count + 1))


def sitting(protocol: StudyProtocol, observer: Observer, seed: int) -> dict[float, float]:
    """Threshold in N of every test run; staircase and draws alone, no device."""
    found, answered = {}, 0
    for run in schedule_runs(protocol, seed, 0):
        state = begin_staircase(protocol.staircase)
        while not is_finished(protocol.staircase, state):
            draw = draw_trial(protocol.schedule, "random", seed, run.index, state.trials, 0)
            level = compute_level_n(protocol.staircase, state)
            felt = PerceivedStimulus(
                run.index, state.trials, 0, run.phase, run.frequency_hz, level, draw.direction, answered
            )
            answered += 1
            state = step(protocol.staircase, state, observer.reply(felt, seed).answer == draw.direction)
        if run.phase is Phase.TEST:
            found[run.frequency_hz] = float(np.mean([to_newton(db) for db in state.reversal_levels_db[-10:]]))
    return found


@pytest.fixture(scope="module")
def protocol() -> StudyProtocol:
    loaded = load_protocol(files("protocols").joinpath("direction_threshold.toml").read_text("utf-8"), "shipped")
    assert isinstance(loaded, StudyProtocol)
    return loaded


@pytest.fixture(scope="module")
def ten_n(protocol) -> Callable[[int], np.ndarray]:
    """(10, 5) thresholds in N of one of four studies, participants by frequencies."""

    @cache
    def measured(study: int) -> np.ndarray:
        seeds, people = range(10 * study, 10 * study + 10), draw_population(40, seed=1)
        sittings = [sitting(protocol, people[seed], seed) for seed in seeds]
        return np.array([[found[frequency] for frequency in FREQUENCIES] for found in sittings])

    return measured


@pytest.fixture(scope="module")
def measured_n(ten_n) -> np.ndarray:
    """(40, 5) thresholds in N: four studies of ten, participants by frequencies."""
    return np.vstack([ten_n(study) for study in range(4)])


@pytest.mark.slow
def test_measured_means_rise_with_frequency_up_to_35_hz(measured_n):
    means = measured_n.mean(axis=0)
    assert (np.diff(means[:4]) > 0.1).all()
    assert means[4] == pytest.approx(means[3], rel=0.15)


@pytest.mark.slow
def test_some_thresholds_are_at_the_cap_at_35_hz_and_none_at_5_hz(measured_n):
    pinned = (measured_n > 2.4).mean(axis=0)
    assert 0.1 < pinned[3] < 0.5
    assert pinned[0] == 0.0


@pytest.mark.parametrize("study", slow_after(1, range(4)))
def test_a_study_of_ten_finds_the_rise_at_35_hz_significant(ten_n, study):
    p_values = tukey_hsd(*ten_n(study).T).pvalue
    assert p_values[2, 3] < 0.05
    assert p_values[0, 3] < 0.05


@pytest.mark.slow
def test_people_who_are_all_the_same_show_no_rise(protocol):
    """Negative control: guessers have one threshold at every frequency."""
    guesser = find_observer("guesser", 0)
    sittings = [sitting(protocol, guesser, seed) for seed in range(10)]
    groups = np.array([[found[frequency] for frequency in FREQUENCIES] for found in sittings]).T
    assert tukey_hsd(*groups).pvalue.min() > 0.05


def test_people_differ_by_about_three_decibels():
    thresholds_db = 20 * np.log10([[n for _, n in person.thresholds_n] for person in draw_population(400, seed=2)])
    assert thresholds_db.std(axis=0, ddof=1) == pytest.approx(np.full(5, 3.02), abs=0.4)
    # Who is good at one frequency is good at another: 2.5^2 / (2.5^2 + 1.7^2).
    assert np.corrcoef(thresholds_db.T)[np.triu_indices(5, 1)].mean() == pytest.approx(0.68, abs=0.08)


def test_people_feel_that_it_shakes_far_below_where_they_feel_the_direction():
    for someone in draw_population(200, seed=2):
        pairs = zip(someone.detection_n, someone.thresholds_n, strict=True)
        assert all(detection_n < 0.8 * direction_n for (_, detection_n), (_, direction_n) in pairs)


def test_people_differ_in_detection_by_as_much_and_independently():
    people = draw_population(400, seed=2)
    detection_db = 20 * np.log10([someone.detection_n[0][1] / TYPICAL_DETECTION_N[0][1] for someone in people])
    direction_db = 20 * np.log10([np.prod([n for _, n in someone.thresholds_n]) ** 0.2 for someone in people])
    assert detection_db.std(ddof=1) == pytest.approx(2.5, abs=0.35)
    assert abs(np.corrcoef(detection_db, direction_db)[0, 1]) < 4 / np.sqrt(400)


def test_the_people_of_older_studies_are_still_the_same():
    """Values of the version before detection trials."""
    someone = draw_population(1, seed=1)[0]
    assert [round(n, 6) for _, n in someone.thresholds_n] == [0.520389, 0.724903, 1.034365, 2.866593, 2.684562]
    assert round(someone.slope, 6) == 1.618158
    assert round(someone.drift_db_per_100_trials, 6) == 0.146749


def test_another_seed_is_other_people():
    assert not set(draw_population(5, seed=3)) & set(draw_population(5, seed=4))


def test_a_logged_name_calls_the_same_person_back():
    person = draw_population(7, seed=12)[6]
    assert person.name == "person_7_seed_12"
    assert find_observer(person.name, seed=99) == person


def test_every_scripted_run_ends(protocol):
    assert set(sitting(protocol, find_observer("scripted", 0), seed=1)) == set(FREQUENCIES)
