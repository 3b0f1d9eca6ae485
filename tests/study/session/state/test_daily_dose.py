"""The dose of a day over several sessions of one participant."""

from dataclasses import replace
from datetime import datetime, timedelta

from study.session.facts.log_time import Moment
from study.session.state.daily_dose import find_dose_elsewhere, set_dose_elsewhere
from study.session.state.sitting_state import (
    SittingState,
    compute_daily_dose,
    pass_time,
    resume_sitting,
    start_motion,
)
from study.session.state.vibration_dose import Dose, compute_a8_mps2

MORNING = datetime.fromisoformat("2026-01-01T08:00:00.000+00:00")


def at(hours: float) -> str:
    return (MORNING + timedelta(hours=hours)).isoformat(timespec="milliseconds")


def session(began_h: float, ended_h: float, vibrated_s: float) -> SittingState:
    """The handle moved at its begin and at its end."""
    begun = start_motion(SittingState(last_moment=Moment(at(began_h))))
    over = start_motion(pass_time(begun, Moment(at(ended_h))))
    return replace(over, dose=Dose(10.0 * vibrated_s, vibrated_s, 0.0))


def test_sessions_of_the_same_day_add_up_and_those_before_a_night_do_not():
    sessions = {"P01_001": session(-14, -13, 7.0), "P01_002": session(0, 1, 20.0), "P01_003": session(3, 4, 30.0)}
    found = find_dose_elsewhere(sessions, "P01_004", at(5))
    assert found is not None
    assert found.sessions == ("P01_002", "P01_003")
    assert (found.squared_s, found.vibrated_s, found.still_s) == (500.0, 50.0, 3600.0)


def test_a_dose_that_only_a_wrong_sensor_gives_does_not_keep_the_next_session_from_beginning():
    shaken = replace(session(0, 1, 20.0), dose=Dose(1e12, 20.0, 0.0))
    found = find_dose_elsewhere({"P01_001": shaken}, "P01_002", at(2))
    fresh = set_dose_elsewhere(SittingState(last_moment=Moment(at(2))), found)
    assert compute_a8_mps2(compute_daily_dose(fresh)) > 100.0


def test_own_movements_join_two_others_into_one_day_and_are_not_counted_twice():
    sessions = {"P01_001": session(-8, -7, 7.0), "P01_002": session(1, 2, 20.0)}
    found = find_dose_elsewhere(sessions, "P01_002", at(4))
    assert found is not None
    assert (found.sessions, found.vibrated_s) == (("P01_001",), 7.0)
    assert find_dose_elsewhere({"P01_002": sessions["P01_002"]}, "P01_002", at(4)) is None


def test_after_a_night_nothing_counts_and_a_clock_set_back_is_no_night():
    sessions = {"P01_001": session(0, 1, 20.0)}
    assert find_dose_elsewhere(sessions, "P01_002", at(11.0)) is None
    back = find_dose_elsewhere(sessions, "P01_002", at(-30.0))
    assert back is not None and (back.vibrated_s, back.still_s) == (20.0, 0.0)
    assert find_dose_elsewhere({"P01_001": SittingState()}, "P01_002", at(0)) is None


def test_what_was_found_counts_until_the_hand_has_rested_for_a_night():
    found = find_dose_elsewhere({"P01_001": session(0, 1, 20.0)}, "P01_002", at(2))
    fresh = set_dose_elsewhere(SittingState(last_moment=Moment(at(2))), found)
    assert compute_daily_dose(fresh).vibrated_s == 20.0
    shaken = replace(start_motion(fresh), dose=Dose(5.0, 5.0, 0.0))
    assert compute_daily_dose(shaken).vibrated_s == 25.0
    assert compute_daily_dose(pass_time(shaken, Moment(at(12.5)))).vibrated_s == 0.0
    assert set_dose_elsewhere(shaken, None).other_sessions_dose.vibrated_s == 0.0


def test_a_session_joins_the_days_of_all_its_sittings():
    """Ten hours without a movement never passed: late at night, in the morning, and in the evening."""
    morning, evening = session(0, 1, 20.0), Moment(at(9))
    resumed = start_motion(resume_sitting(pass_time(morning, evening, resumed=True), 0))
    sessions = {"P01_001": session(-9, -8, 7.0), "P01_002": resumed}
    found = find_dose_elsewhere(sessions, "P01_003", at(9.5))
    assert found is not None
    assert (found.sessions, found.vibrated_s) == (("P01_001", "P01_002"), 27.0)
    rested = start_motion(resume_sitting(pass_time(morning, Moment(at(11)), resumed=True), 0))
    assert rested.day_s == 0.0
    found = find_dose_elsewhere({**sessions, "P01_002": rested}, "P01_003", at(11.5))
    assert found is not None
    assert found.sessions == ("P01_002",)
