"""Order of a session's runs and random draws of its trials, each from its own key (counter-based random numbers).

A draw depends only on the seed and its key (such as run, trial, attempt), not on earlier draws: a repeated trial, a
resumed session or a replay changes no later draw. The random 64-bit words come directly from numpy's SeedSequence,
whose output is guaranteed never to change, so that a session can be checked years later.
"""

from dataclasses import dataclass

import numpy as np

from protocols.definition.preparation import DemoSettings, PracticeSettings
from protocols.definition.session_settings import CatchSettings
from protocols.definition.study_protocol import ScheduleSettings, StudyProtocol
from protocols.procedure.staircase import to_db, to_newton
from protocols.trial import Phase

BALANCED_BLOCK_TRIALS = 8
"""Block length (trials) within which balanced directions occur equally often; even. Chosen; part of the format: a
change would change the draws of earlier sessions."""
_CATCH_KEY, _DETECTION_KEY, _ROVE_KEY = 0, 1, 2
"""Purpose in the keys of four elements: the last element for the direction in detection and for roving; the keys of
catch trials end in `_CATCH_KEY` and 0. A key of four elements never gives the same words as a trial's key of three."""


def make_williams_rows(condition_count: int) -> tuple[tuple[int, ...], ...]:
    """Make a Williams design (Latin square balanced for first-order carry-over): orders of the conditions 0 to n - 1.

    n: condition_count. One row per participant. Over all rows each condition occurs in each position equally often, and
    follows each other condition equally often: once in the n rows of an even n, twice in the 2 n rows of an odd n.
    Raises ValueError for fewer than one condition.

    Source: E. J. Williams, Experimental designs balanced for the estimation of residual effects of treatments,
    Australian Journal of Scientific Research A 2 (1949), 149-168.
    """
    if condition_count < 1:
        raise ValueError(f"a Williams design needs one condition at the least, not {condition_count}")
    # 0, 1, n-1, 2, n-2, …: for an even n all successive differences modulo n are different, so that the shifted rows
    # contain each ordered pair of neighbours once. For an odd n the reversed rows supply the missing pairs.
    first_row = [0]
    for position in range(1, condition_count):
        first_row.append((position + 1) // 2 if position % 2 else condition_count - position // 2)
    rows = tuple(
        tuple((condition + shift) % condition_count for condition in first_row) for shift in range(condition_count)
    )
    if condition_count % 2 == 0:
        return rows
    return rows + tuple(row[::-1] for row in rows)


@dataclass(frozen=True, slots=True)
class Run:
    """One run of a session: a staircase, or a practice."""

    index: int
    """Number of the run in the session, from 0; the order is training, practice, test, detection."""
    phase: Phase
    frequency_hz: float
    """Stimulus frequency of the run (Hz)."""
    practice: bool = False
    """True for a training run without a staircase, which ends by a criterion (`protocols.procedure.practice`)."""


@dataclass(frozen=True, slots=True)
class Draw:
    """Random choices for one presentation of a stimulus: its direction and its polarity."""

    direction: int
    """1 or 2, in the order of the protocol; `label_direction` gives the number on the screen. In detection: the
    interval with the stimulus."""
    polarity: int
    """Sign of the first half-wave, 1 or -1."""


def schedule_runs(protocol: StudyProtocol, seed: int, participant_number: int) -> tuple[Run, ...]:
    """List all runs of a session: training and practice as listed in the protocol, the test runs in the order of
    `order_frequencies`, then detection as listed. participant_number: from 0."""
    ordered_frequencies_hz = order_frequencies(
        protocol.schedule, protocol.stimulus.frequencies_hz, seed, participant_number
    )
    phases_and_frequencies = [
        *((Phase.TRAINING, frequency_hz, False) for frequency_hz in protocol.training.frequencies_hz),
        *((Phase.TRAINING, frequency_hz, True) for frequency_hz in protocol.practice.frequencies_hz),
        *((Phase.TEST, frequency_hz, False) for frequency_hz in ordered_frequencies_hz),
        *((Phase.DETECTION, frequency_hz, False) for frequency_hz in protocol.detection.frequencies_hz),
    ]
    return tuple(Run(index, *run) for index, run in enumerate(phases_and_frequencies))


def order_frequencies(
    settings: ScheduleSettings, frequencies_hz: tuple[float, ...], seed: int, participant_number: int
) -> tuple[float, ...]:
    """Order the test frequencies (Hz) by their runs. participant_number: from 0; only the Williams design uses it."""
    match settings.order:
        case "as_listed":
            return frequencies_hz
        case "random":
            return tuple(frequencies_hz[index] for index in _draw_permutation(seed, (), len(frequencies_hz)))
        case "williams":
            if not frequencies_hz:
                return ()
            rows = make_williams_rows(len(frequencies_hz))
            return tuple(frequencies_hz[index] for index in rows[participant_number % len(rows)])


def draw_trial(settings: ScheduleSettings, onset_polarity: str, seed: int, run: int, trial: int, attempt: int) -> Draw:
    """Draw direction and polarity of one presentation. onset_polarity: "random" or "positive"."""
    direction_bit, polarity_bit = (int(word) >> 63 for word in draw_words(seed, (run, trial, attempt), 2))
    direction = 1 + direction_bit
    if settings.directions == "balanced" and attempt == 0:
        # A repeated trial (attempt > 0, only in sessions under version 1 of `study.session.state.rules`) is drawn
        # independently of the block: otherwise its direction would be that of the first attempt, already felt.
        block, position = divmod(trial, BALANCED_BLOCK_TRIALS)
        direction = 1 + _draw_permutation(seed, (run, block), BALANCED_BLOCK_TRIALS)[position] % 2
    return Draw(direction, 1 if onset_polarity == "positive" else 1 - 2 * polarity_bit)


def is_catch_trial(settings: CatchSettings, seed: int, run: int, trial: int) -> bool:
    """Whether this trial of a test run is a catch trial: one in each block of `one_in` trials, at a random position;
    none where `one_in` is 0."""
    if not settings.one_in:
        return False
    block, position = divmod(trial, settings.one_in)
    return draw_words(seed, (run, block, _CATCH_KEY, 0), 1)[0] % settings.one_in == position


def draw_detection_direction(seed: int, run: int, trial: int, attempt: int) -> int:
    """Draw the direction, 1 or 2, of a detection trial's stimulus. The interval that contains it is drawn by
    `draw_trial`."""
    return 1 + (draw_words(seed, (run, trial, attempt, _DETECTION_KEY), 1)[0] >> 63)


def draw_practice_level_n(settings: PracticeSettings, seed: int, run: int, trial: int, attempt: int) -> float:
    """Draw the amplitude (N) of a practice trial, independently of the direction."""
    return _draw_level_n(settings.level_n, settings.rove_db, seed, (run, trial, attempt, _ROVE_KEY))


def rove_level_n(nominal_n: float, rove_db: float, seed: int, run: int, trial: int, attempt: int) -> float:
    """Draw the amplitude (N) of a staircase trial around its level `nominal_n`, independently of the direction."""
    return _draw_level_n(nominal_n, rove_db, seed, (run, trial, attempt, _ROVE_KEY))


def draw_demo_level_n(settings: DemoSettings, seed: int, earlier_demos: int) -> float:
    """Draw the amplitude (N) of a demonstration. earlier_demos: number of earlier demonstrations in the session."""
    return _draw_level_n(settings.level_n, settings.rove_db, seed, (earlier_demos,))


def _draw_level_n(level_n: float, rove_db: float, seed: int, key: tuple[int, ...]) -> float:
    """Draw a roved level (N): uniform in dB over a range of width `rove_db`, centred on `level_n` (N)."""
    if rove_db == 0:
        return level_n
    # The upper 53 bits, as a number in the open interval (0, 1).
    uniform = ((draw_words(seed, key, 1)[0] >> 11) + 0.5) * 2.0**-53
    return to_newton(to_db(level_n) + rove_db * (uniform - 0.5))


def are_labels_swapped(settings: ScheduleSettings, frequency_count: int, participant_number: int) -> bool:
    """Whether the numbers 1 and 2 are exchanged for this participant: unless labels are fixed, for every second
    participant, and for the other half on the next pass through the Williams rows, so that each order of the
    frequencies occurs with both labellings. frequency_count: number of stimulus frequencies; participant_number: from
    0."""
    if settings.labels == "fixed":
        return False
    completed_passes = (
        participant_number // len(make_williams_rows(frequency_count))
        if settings.order == "williams" and frequency_count
        else 0
    )
    return (participant_number + completed_passes) % 2 == 1


def label_direction(direction: int, is_swapped: bool) -> int:
    """Return the number on the screen, 1 or 2, for a direction, and also the direction for a number on the screen."""
    return 3 - direction if is_swapped else direction


def draw_words(seed: int, key: tuple[int, ...], count: int) -> tuple[int, ...]:
    """Draw `count` pseudo-random 64-bit words for a key. The length is part of the key, so that keys of different
    lengths give different words."""
    sequence = np.random.SeedSequence(entropy=seed, spawn_key=(len(key), *key))
    return tuple(int(word) for word in sequence.generate_state(count, np.uint64))


def _draw_permutation(seed: int, key: tuple[int, ...], size: int) -> tuple[int, ...]:
    """Draw a random permutation of 0 to size - 1 by sorting independent 64-bit words; the probability of a tie is below
    size² / 2^65."""
    words = draw_words(seed, key, size)
    return tuple(sorted(range(size), key=words.__getitem__))
