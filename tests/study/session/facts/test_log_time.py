"""A wall clock that is set forward or back: what the limits of a sitting and the vibration dose make of it."""

import random
from dataclasses import replace
from datetime import datetime, timedelta

import pytest

from protocols.definition.session_settings import SittingLimits
from study.session.facts.events import DemoPlayed, NoteTaken, SessionInterrupted, SessionResumed
from study.session.facts.log_time import ClockStep, Moment, compute_elapsed_s, find_clock_step
from study.session.state.fold import apply_event
from study.session.state.machine import find_reached_limit
from study.session.state.sitting_state import DAILY_REST_H, compute_daily_dose, pass_time
from study.session.state.state import begin_session

H = 3600.0
START = datetime.fromisoformat("2026-01-01T08:00:00.000+00:00")
VIBRATION_S = 100.0


class Computer:
    """Two clocks and a log: what passes for both, and what only the wall clock is set by."""

    def __init__(self, state, monotonic: bool = True) -> None:
        self.wall_s, self.true_s, self.monotonic = 0.0, 500.0, monotonic
        self.state = replace(state, sitting=pass_time(state.sitting, Moment(self.utc, self.stamp)))

    @property
    def utc(self) -> str:
        return (START + timedelta(seconds=self.wall_s)).isoformat(timespec="milliseconds")

    @property
    def stamp(self) -> float | None:
        return self.true_s if self.monotonic else None

    def wait(self, seconds: float) -> "Computer":
        self.wall_s, self.true_s = self.wall_s + seconds, self.true_s + seconds
        return self

    def set_by(self, seconds: float) -> "Computer":
        self.wall_s += seconds
        return self

    def log(self, event) -> "Computer":
        self.state = apply_event(self.state, event)
        return self

    def vibrate(self) -> "Computer":
        return self.log(DemoPlayed(self.utc, 25.0, 1.0, 1, 135.0, VIBRATION_S, monotonic_s=self.stamp))

    def note(self) -> "Computer":
        return self.log(NoteTaken(self.utc, "program", "a note", monotonic_s=self.stamp))

    def leave(self) -> "Computer":
        return self.log(SessionInterrupted(self.utc, "over", monotonic_s=self.stamp))

    def resume(self) -> "Computer":
        """By another process: after a start of the computer its monotonic clock begins anywhere."""
        self.true_s = 7.0
        return self.log(SessionResumed(self.utc, self.state.opened.device, {}, monotonic_s=self.stamp))

    @property
    def vibrated_s(self) -> float:
        return compute_daily_dose(pass_time(self.state.sitting, Moment(self.utc, self.stamp))).vibrated_s

    @property
    def steps_h(self) -> list[float]:
        return [round(step.step_s / H, 3) for step in self.state.sitting.clock_steps]

    def limit(self) -> str:
        return find_reached_limit(self.state, self.utc, self.stamp)


@pytest.fixture
def begun(facts, small_protocol, small_text):
    protocol = replace(small_protocol, limits=SittingLimits(longest_min=60.0))

    def begin(monotonic: bool = True) -> Computer:
        return Computer(begin_session(facts.opened(protocol, small_text, utc=START.isoformat()), protocol), monotonic)

    return begin


def test_a_clock_set_forward_in_a_sitting_is_no_night_and_no_time(begun):
    computer = begun().vibrate().set_by(10 * H)
    assert computer.vibrated_s == VIBRATION_S
    assert computer.limit() == ""
    assert computer.vibrate().vibrated_s == 2 * VIBRATION_S
    assert computer.wait(60 * 60).limit().startswith("the longest sitting of 60 minutes")
    assert computer.steps_h == [10.0]


def test_a_clock_set_back_in_a_sitting_takes_no_time_away(begun):
    computer = begun().vibrate().wait(30 * 60).set_by(-10 * H).vibrate().wait(29 * 60)
    assert computer.limit() == ""
    assert computer.state.sitting.sitting_elapsed_s == 30 * 60
    assert computer.wait(60).limit() != ""
    assert computer.steps_h == [-10.0]


def test_what_the_clock_was_set_by_after_the_last_movement_is_no_rest_either(begun):
    """The entry that ends the sitting still knows both clocks."""
    computer = begun().vibrate().wait(60).set_by(10 * H).leave().wait(5 * 60).resume()
    assert computer.vibrated_s == VIBRATION_S
    assert computer.state.sitting.still_s == pytest.approx(6 * 60)


def test_between_sittings_a_night_counts_and_a_clock_set_back_is_no_time(begun):
    assert begun().vibrate().leave().wait(DAILY_REST_H * H).resume().vibrated_s == 0.0
    back = begun().vibrate().leave().wait(60).set_by(-2 * H).resume()
    assert back.vibrated_s == VIBRATION_S
    assert back.state.sitting.still_s == 0.0
    assert back.wait(59 * 60).limit() == ""
    (step,) = back.state.sitting.clock_steps
    assert step.between_sittings
    assert step.sentence.startswith("The computer's clock reads 1 h 59 min earlier than at the last entry of the log.")


def test_a_night_that_the_clock_made_up_gives_the_dose_back_when_the_clock_is_set_back(begun):
    in_sitting = begun().vibrate().leave().set_by(10 * H).resume().vibrate()
    assert in_sitting.vibrated_s == VIBRATION_S  # it cannot be known yet
    assert in_sitting.wait(60).set_by(-10 * H).note().vibrated_s == 2 * VIBRATION_S
    between = begun().vibrate().leave().set_by(10 * H).resume().vibrate().leave().set_by(-10 * H).resume()
    assert between.vibrated_s == 2 * VIBRATION_S
    before_moving = begun().vibrate().leave().set_by(10 * H).resume().set_by(-10 * H).vibrate()
    assert before_moving.vibrated_s == 2 * VIBRATION_S


def test_a_step_forward_that_was_known_and_is_taken_back_leaves_a_true_night_alone(begun):
    computer = begun().vibrate().leave().wait(12 * H).resume().vibrate().set_by(10 * H).note().set_by(-10 * H).note()
    assert computer.vibrated_s == VIBRATION_S
    assert computer.steps_h == [10.0, -10.0]


def test_a_log_without_monotonic_times_folds_by_the_wall_clock_but_never_backwards(begun):
    forward = begun(monotonic=False).vibrate().wait(DAILY_REST_H * H)
    assert forward.vibrated_s == 0.0
    back = begun(monotonic=False).vibrate().wait(600).vibrate().set_by(-5 * H).vibrate()
    assert back.vibrated_s == 3 * VIBRATION_S
    assert back.state.sitting.sitting_elapsed_s == 600.0
    assert back.steps_h == [-5.0]


def test_small_corrections_of_the_clock_are_not_worth_a_word():
    before = Moment(START.isoformat(), 0.0)
    late = Moment((START + timedelta(seconds=4)).isoformat(), 1.0)
    assert find_clock_step(before, late) is None
    assert compute_elapsed_s(before, late) == 1.0
    assert compute_elapsed_s(late, before) == 0.0


@pytest.mark.parametrize(
    ("by_s", "said"),
    [
        (36000.0, "The computer's clock was set forward by 10 h 0 min, or the computer slept that long."),
        (-90.0, "The computer's clock was set back by 90 s."),
        (-600.0, "The computer's clock was set back by 10 min."),
    ],
)
def test_a_step_is_reported_in_words(by_s, said):
    sentence = ClockStep("", by_s, between_sittings=False).sentence
    assert sentence == f"{said} Time limits and the vibration dose do not follow it; the times in the log do."


@pytest.mark.parametrize("seed", range(40))
def test_however_the_clock_is_set_within_sittings_the_dose_and_the_time_are_the_true_ones(begun, seed):
    """Random sittings of some hours, true pauses of up to six hours between them, steps of up to two days."""
    draw = random.Random(seed)
    computer, sat_s, vibrations = begun(), None, 0
    for _ in range(60):
        computer.wait(passed := draw.uniform(0.0, 120.0))
        sat_s = None if sat_s is None else sat_s + passed
        match draw.choice(("vibrate", "note", "set", "sit again")):
            case "vibrate":
                computer.vibrate()
                vibrations, sat_s = vibrations + 1, sat_s or 0.0
            case "note":
                computer.note()
            case "set":
                computer.set_by(draw.choice((-1, 1)) * draw.uniform(10.0, 48 * H)).note()
            case "sit again":
                computer.leave().wait(draw.uniform(0.0, 0.2 * H)).resume()
                sat_s = None
        sitting = pass_time(computer.state.sitting, Moment(computer.utc, computer.stamp))
        assert sitting.sitting_elapsed_s == (None if sat_s is None else pytest.approx(sat_s)), f"seed {seed}"
        assert sitting.still_s is None or sitting.still_s >= 0.0
        assert computer.vibrated_s == vibrations * VIBRATION_S, f"seed {seed}"
