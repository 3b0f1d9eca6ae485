"""Consistency checks of a study protocol across its tables: finds values that contradict each other.

Most contradictions within a table are found by the table's class. Each function that finds problems names their keys by
dotted paths from the top of the protocol; an empty list means that there is none.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from protocols.definition.declared_analysis import INTERVAL_BY_ANALYSIS
from protocols.definition.probes import find_probe_contradictions
from protocols.definition.problem import Problem

if TYPE_CHECKING:
    from protocols.definition.study_protocol import StudyProtocol

FORCE_TOLERANCE_N = 1e-9
"""Tolerance (N) for rounding errors when forces are compared; chosen, far below the resolution of any device."""


def find_contradictions(protocol: StudyProtocol) -> list[Problem]:
    """Find all contradictions between tables of the protocol; empty if it is consistent."""
    return [
        *_find_cap_problems(protocol),
        *_find_psi_problems(protocol),
        *_find_level_problems(protocol),
        *_find_time_problems(protocol),
        *_find_duplicates(protocol),
        *_find_analysis_problems(protocol),
        *find_probe_contradictions(protocol),
    ]


def compute_highest_roved_n(level_n: float, rove_db: float) -> float:
    """Compute the highest level (N) that roving draws: `level_n` (N) raised by half of the range `rove_db` (dB)."""
    return level_n * float(10.0 ** (rove_db / 2 / 20))


def _find_cap_problems(protocol: StudyProtocol) -> list[Problem]:
    """Find a staircase's cap, with or without roving, that is above the stimulus cap of the safety layer."""
    cap_n, safety_cap_n, rove_db = protocol.staircase.cap_n, protocol.safety.stimulus_cap_n, protocol.stimulus.rove_db
    if safety_cap_n < cap_n:
        problem_text = f"is {safety_cap_n} N, below staircase.cap_n: the highest levels could not be played"
        return [Problem("safety.stimulus_cap_n", problem_text, f"at least {cap_n} N, the staircase's cap")]
    highest_n = compute_highest_roved_n(cap_n, rove_db)
    if highest_n <= safety_cap_n + FORCE_TOLERANCE_N:
        return []
    problem_text = f"is {cap_n:g} N, and roving (stimulus.rove_db) adds up to {highest_n - cap_n:.3g} N to it"
    largest_cap_n = safety_cap_n / compute_highest_roved_n(1.0, rove_db)
    # Rounded down to 1 mN, so that the cap which the message states passes this check.
    allowed = f"at most {math.floor(1000 * largest_cap_n) / 1000:g} N, so that none is above safety.stimulus_cap_n"
    return [Problem("staircase.cap_n", problem_text, allowed)]


def _find_psi_problems(protocol: StudyProtocol) -> list[Problem]:
    """Find roved levels, and a trial limit that ends a test or detection run before its trials, where Psi is used."""
    problems, psi_trial_count = [], protocol.staircase.bayesian.trials
    if protocol.stimulus.rove_db and protocol.staircase.is_bayesian:
        problem_text = f"is {protocol.stimulus.rove_db:g} dB, but Psi assumes that levels are played as planned"
        problems.append(Problem("stimulus.rove_db", problem_text, "0, or 0 in staircase.bayesian.trials"))
    # The limit of a training run may be lower: training needs no threshold.
    trial_limits = {
        "staircase.trial_limit": protocol.staircase.trial_limit,
        "detection.trial_limit": protocol.detection.trial_limit if protocol.detection.frequencies_hz else 0,
    }
    for key, limit in trial_limits.items():
        if 0 < limit < psi_trial_count:
            problem_text = f"is {limit}, and would end every such run before the {psi_trial_count} trials of Psi"
            problems.append(
                Problem(key, problem_text, f"0, or at least {psi_trial_count}, as in staircase.bayesian.trials")
            )
    return problems


def _find_level_problems(protocol: StudyProtocol) -> list[Problem]:
    """Find highest levels of demonstration, practice and detection, roving included, that are above the staircase's
    cap. Practice and detection without frequencies are not played, and pass."""
    cap_n, practice, detection = protocol.staircase.cap_n, protocol.practice, protocol.detection
    highest_levels_n = {
        "demo.level_n": compute_highest_roved_n(protocol.demo.level_n, protocol.demo.rove_db),
        "practice.level_n": compute_highest_roved_n(practice.level_n, practice.rove_db)
        if practice.frequencies_hz
        else 0.0,
        "detection.start_n": detection.start_n if detection.frequencies_hz else 0.0,
    }
    problems = []
    for key, level_n in highest_levels_n.items():
        if level_n > cap_n + FORCE_TOLERANCE_N:
            rove_note = "" if key == "detection.start_n" else ", with its rove_db,"
            problem_text = f"is {level_n:g} N{rove_note} above staircase.cap_n"
            problems.append(Problem(key, problem_text, f"at most {cap_n} N, the cap"))
    return problems


def _find_time_problems(protocol: StudyProtocol) -> list[Problem]:
    """Find a time limit of a trial not below the safety limit, a recorded time shorter than a period of the lowest
    frequency, a detection interval no longer than its fades, and a protocol that plays no frequency at all."""
    problems, time_limit_s = [], protocol.trial.time_limit_s
    if time_limit_s >= protocol.safety.longest_trial_s:
        problem_text = f"is {time_limit_s} s, not below safety.longest_trial_s, which releases the device"
        allowed = f"below {protocol.safety.longest_trial_s} s, or 0 for none"
        problems.append(Problem("trial.time_limit_s", problem_text, allowed))
    if frequencies_hz := protocol.all_frequencies_hz:
        period_s = 1 / min(frequencies_hz)
        if protocol.measurement.keep_s < period_s:
            problem_text = f"is {protocol.measurement.keep_s} s, less than one period of the lowest frequency"
            # Rounded up to 0.1 ms, so that the time which the message states passes this check; 1e-6 of this unit
            # absorbs the rounding error of a period that is a whole number of units.
            shortest_keep_s = math.ceil(1e4 * period_s - 1e-6) / 1e4
            problems.append(Problem("measurement.keep_s", problem_text, f"at least {shortest_keep_s:g} s"))
    else:
        problem_text = "is empty, and so are training, practice and detection: nothing would be played"
        problems.append(Problem("stimulus.frequencies_hz", problem_text, "at least one frequency in one of them"))
    detection, fades_s = protocol.detection, protocol.stimulus.fade_in_s + protocol.stimulus.fade_out_s
    if detection.frequencies_hz and detection.interval_s <= fades_s:
        problem_text = f"is {detection.interval_s} s, no longer than the fades together"
        problems.append(Problem("detection.interval_s", problem_text, f"more than {fades_s:g} s"))
    return problems


def _find_duplicates(protocol: StudyProtocol) -> list[Problem]:
    """Find device buttons that are not two different ones (or none), and keys that a list of questions uses twice."""
    problems, button_numbers = [], protocol.trial.device_buttons
    if len(set(button_numbers)) not in (0, 2):
        problems.append(
            Problem("trial.device_buttons", f"is {list(button_numbers)}", "two different button numbers, or none")
        )
    for name, questions in (("before", protocol.before), ("debrief", protocol.debrief)):
        if len({question.key for question in questions}) < len(questions):
            problems.append(Problem(name, "uses a key twice", "a key of its own for every question"))
    return problems


def _find_analysis_problems(protocol: StudyProtocol) -> list[Problem]:
    """Find a declared contrast that is not of two test frequencies, and an interval that the declared primary analysis
    does not compute."""
    problems, analysis_settings = [], protocol.analysis
    contrast_hz, frequencies_hz = analysis_settings.contrast_hz, protocol.stimulus.frequencies_hz
    if contrast_hz and (len(set(contrast_hz)) != 2 or not set(contrast_hz) <= set(frequencies_hz)):
        allowed = "two different ones of stimulus.frequencies_hz, or none"
        problems.append(Problem("analysis.contrast_hz", f"is {list(contrast_hz)}", allowed))
    matching_interval = INTERVAL_BY_ANALYSIS.get(analysis_settings.primary)
    if analysis_settings.interval not in ("undeclared", matching_interval):
        problem_text = f"is {analysis_settings.interval}, while primary is {analysis_settings.primary}"
        allowed = f"{matching_interval}, or undeclared" if matching_interval else "undeclared, or declare primary, too"
        problems.append(Problem("analysis.interval", problem_text, allowed))
    return problems
