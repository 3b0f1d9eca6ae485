"""Simulated participants straight through the staircase: no device, no session, no file."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from analysis.figures.diagnosis.diagnosis_pictures import draw_diagnosis_pictures
from protocols.definition.apparatus import SafetySettings, TestDirections
from protocols.definition.preparation import PracticeSettings
from protocols.definition.session_settings import CatchSettings, DetectionSettings
from protocols.definition.staircase_rule import StaircaseRule, StepPhase
from protocols.definition.study_protocol import StimulusSettings, StudyProtocol, TrainingSettings
from protocols.procedure.run_rules import make_staircase_rule
from protocols.procedure.staircase import StaircaseState, begin_staircase, compute_level_n, is_finished, step
from protocols.trial import Phase, Trial, TrialStatus

PUBLISHED = StaircaseRule(
    start_n=1.0,
    cap_n=3.0,
    up_after_wrong=1,
    down_after_right=3,
    steps=(StepPhase(step_db=4.0, reversals=3), StepPhase(step_db=1.0, reversals=10)),
    reversals=13,
    averaged_reversals=10,
)
GUESSER = math.inf
DELIVERED_PER_NEWTON = 4.0


def probability_correct(level: float, true_n: float, slope: float, lapse: float) -> float:
    """Weibull observer of two alternatives whose 79.37 % level is true_n."""
    if math.isinf(true_n):
        return 0.5
    scale = true_n / (-math.log(1 - (0.5 ** (1 / 3) - 0.5) / (0.5 - lapse))) ** (1 / slope)
    return 0.5 + (0.5 - lapse) * (1 - math.exp(-((level / scale) ** slope)))


TEMPLATE = Trial(
    subject="s01",
    session="1",
    run=1,
    trial=1,
    attempt=1,
    phase=Phase.TEST,
    frequency_hz=15.0,
    level_n=1.0,
    direction_shown=1,
    answer=1,
    correct=True,
    reversal=False,
    response_time_s=1.0,
    delivered_mps2=DELIVERED_PER_NEWTON,
    off_axis_mps2=0.5,
    displacement_mm=0.1,
    missed_ticks=0,
    felt=None,
    status=TrialStatus.OK,
)


def simulate_run(
    true_n: float,
    generator: np.random.Generator,
    *,
    rule: StaircaseRule = PUBLISHED,
    slope: float = 2.0,
    lapse: float = 0.02,
    **columns: object,
) -> list[Trial]:
    """One run of a Weibull observer; columns: values of the trial's columns that differ from the template."""
    state, trials = begin_staircase(rule), []
    template = replace(TEMPLATE, **columns)
    while not is_finished(rule, state):
        level_played = compute_level_n(rule, state)
        correct = bool(generator.random() < probability_correct(level_played, true_n, slope, lapse))
        state, trial = play_trial(rule, state, template, correct, int(generator.integers(1, 3)))
        trials.append(trial)
    return trials


def simulate_run_with_catches(
    generator: np.random.Generator, *, lapse: float, one_in: int, true_n: float = 0.6, **columns: object
) -> list[Trial]:
    """A test run with a catch trial in every block of `one_in`, wrong with the chance `lapse`; it steers nothing."""
    steering, trials = simulate_run(true_n, generator, **columns), []
    for trial in steering:
        block_position = len(trials) % one_in
        if block_position == one_in - 1:
            wrong = bool(generator.random() < lapse)
            direction = trial.direction_shown
            answer = 3 - direction if wrong else direction
            catch_trial = replace(trial, phase=Phase.CATCH, level_n=PUBLISHED.cap_n, correct=not wrong, answer=answer)
            trials.append(replace(catch_trial, trial=len(trials) + 1, reversal=False))
        trials.append(replace(trial, trial=len(trials) + 1))
    return trials


def play_trial(
    rule: StaircaseRule, state: StaircaseState, template: Trial, correct: bool, direction: int
) -> tuple[StaircaseState, Trial]:
    level = compute_level_n(rule, state)
    next_state = step(rule, state, correct)
    trial = replace(
        template,
        trial=next_state.trials,
        level_n=level,
        direction_shown=direction,
        answer=direction if correct else 3 - direction,
        correct=correct,
        reversal=next_state.reversals > state.reversals,
        delivered_mps2=DELIVERED_PER_NEWTON * level,
        off_axis_mps2=0.5 * level,
        displacement_mm=0.1 * level,
    )
    return next_state, trial


def run_from_answers(answers: str, rule: StaircaseRule = PUBLISHED) -> list[Trial]:
    """A run from answers written as 1 (right) and 0 (wrong), directions in turn; the rest after the end is not used."""
    state, trials = begin_staircase(rule), []
    for index, answer in enumerate(answers):
        if not is_finished(rule, state):
            state, trial = play_trial(rule, state, TEMPLATE, answer == "1", 1 + index % 2)
            trials.append(trial)
    return trials


@pytest.fixture
def rule() -> StaircaseRule:
    return PUBLISHED


@pytest.fixture(scope="session")
def protocol() -> StudyProtocol:
    return StudyProtocol(
        name="direction_threshold",
        kind="study",
        title="Direction threshold",
        stimulus=StimulusSettings(frequencies_hz=(5.0, 15.0, 25.0, 35.0, 45.0)),
        staircase=PUBLISHED,
        directions=TestDirections(),
        safety=SafetySettings(stimulus_cap_n=3.0, total_cap_n=5.0),
    )


@pytest.fixture
def simulate() -> Callable[..., list[Trial]]:
    return simulate_run


@pytest.fixture
def simulate_with_catches() -> Callable[..., list[Trial]]:
    return simulate_run_with_catches


@pytest.fixture
def make_run_from_answers() -> Callable[..., list[Trial]]:
    return run_from_answers


@pytest.fixture(scope="session")
def simulate_study() -> Callable[..., list[Trial]]:
    """A whole study: thresholds rise with frequency; people differ by a factor."""

    def study(
        subjects: int = 10,
        true_n: Sequence[float] = (0.6, 0.7, 0.8, 2.4, 6.0),
        seed: int = 1,
        felt: bool | None = None,
        rule: StaircaseRule = PUBLISHED,
    ) -> list[Trial]:
        frequencies = (5.0, 15.0, 25.0, 35.0, 45.0)
        trials: list[Trial] = []
        for number in range(subjects):
            generator = np.random.default_rng([seed, number])
            factor = 10 ** (generator.normal(0, 3.0) / 20)
            for run, index in enumerate(generator.permutation(len(true_n)), start=1):
                trials += simulate_run(
                    true_n[index] * factor,
                    generator,
                    rule=rule,
                    subject=f"s{number + 1:02d}",
                    run=run,
                    frequency_hz=frequencies[index],
                    felt=felt,
                )
        return trials

    return study


@pytest.fixture
def full_protocol(protocol: StudyProtocol) -> StudyProtocol:
    """The protocol with training, practice, catch trials and a detection run."""
    return replace(
        protocol,
        training=TrainingSettings(frequencies_hz=(5.0,)),
        practice=PracticeSettings(frequencies_hz=(15.0, 35.0)),
        catch=CatchSettings(one_in=10),
        detection=DetectionSettings(frequencies_hz=(35.0,)),
    )


@pytest.fixture
def all_trial_kinds(simulate_study: Callable[..., list[Trial]], full_protocol: StudyProtocol) -> list[Trial]:
    """Three participants of `simulate_study` with every kind of trial beside the staircases."""
    trials = [replace(trial, run=trial.run + 2) for trial in simulate_study(subjects=3)]
    rule = make_staircase_rule(full_protocol, Phase.DETECTION)
    generator = np.random.default_rng(6)
    other_trials: list[Trial] = []
    for subject in dict.fromkeys(trial.subject for trial in trials):
        person_columns = {"subject": subject}
        other_trials += simulate_run(0.5, generator, run=0, phase=Phase.TRAINING, frequency_hz=5.0, **person_columns)
        for run, frequency in ((1, 15.0), (2, 35.0)):
            practice = replace(
                TEMPLATE, run=run, phase=Phase.TRAINING, frequency_hz=frequency, level_n=2.0, **person_columns
            )
            other_trials += [replace(practice, trial=number) for number in range(4)]
        other_trials += simulate_run(
            0.1, generator, rule=rule, run=8, phase=Phase.DETECTION, frequency_hz=35.0, **person_columns
        )
    for last in {(trial.subject, trial.run): trial for trial in trials}.values():
        first = replace(last, trial=0, phase=Phase.CATCH, level_n=PUBLISHED.cap_n, correct=True)
        other_trials.append(replace(first, answer=first.direction_shown, reversal=False))
    return other_trials + trials


@pytest.fixture(scope="session")
def friction_findings(diagnosed):
    """Findings on one axis whose model lacks dry friction and has a damping that is 0.8 % off."""
    model = diagnosed.device(1)
    return diagnosed.diagnosed(diagnosed.recorded(1), replace(model, damping=1.008 * model.damping))


@pytest.fixture(scope="session")
def friction_pictures(friction_findings):
    """Drawn once."""
    return draw_diagnosis_pictures(friction_findings)
