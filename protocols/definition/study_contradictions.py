"""Checks of a study protocol across tables: values that contradict each other."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from protocols.definition.declared_analysis import INTERVALS
from protocols.definition.probes import find_probe_contradictions
from protocols.definition.problem import Problem

if TYPE_CHECKING:
    from protocols.definition.study_protocol import StudyProtocol

ROUNDING_N = 1e-9
"""Tolerance for rounding when forces are compared (N)."""


def find_contradictions(protocol: StudyProtocol) -> list[Problem]:
    """All contradictions between tables of the protocol; empty if it is consistent."""
    return [
        *_check_caps(protocol),
        *_check_placement(protocol),
        *_check_levels(protocol),
        *_check_times(protocol),
        *_check_names(protocol),
        *_check_declared(protocol),
        *find_probe_contradictions(protocol),
    ]


def highest_roved_n(level_n: float, rove_db: float) -> float:
    """The highest level (N) that roving draws: half of its range in dB lies above `level_n`."""
    return level_n * float(10.0 ** (rove_db / 2 / 20))


def _check_caps(protocol: StudyProtocol) -> list[Problem]:
    """The staircase's cap, roved, against the safety layer's."""
    cap_n, safety_cap_n, rove_db = protocol.staircase.cap_n, protocol.safety.stimulus_cap_n, protocol.stimulus.rove_db
    if safety_cap_n < cap_n:
        wrong = f"is {safety_cap_n} N, below staircase.cap_n: the highest levels could not be played"
        return [Problem("safety.stimulus_cap_n", wrong, f"at least {cap_n} N, the staircase's cap")]
    highest_n = highest_roved_n(cap_n, rove_db)
    if highest_n <= safety_cap_n + ROUNDING_N:
        return []
    wrong = f"is {cap_n:g} N, and roving (stimulus.rove_db) adds up to {highest_n - cap_n:.3g} N to it"
    room_n = safety_cap_n / highest_roved_n(1.0, rove_db)
    # Rounded down, so that the cap which the message allows is allowed.
    allowed = f"at most {math.floor(1000 * room_n) / 1000:g} N, so that none is above safety.stimulus_cap_n"
    return [Problem("staircase.cap_n", wrong, allowed)]


def _check_placement(protocol: StudyProtocol) -> list[Problem]:
    """What the Bayesian placement of levels (Psi) needs: levels as planned, and room for all its trials."""
    problems, trials = [], protocol.staircase.bayesian.trials
    if protocol.stimulus.rove_db and protocol.staircase.is_bayesian:
        wrong = f"is {protocol.stimulus.rove_db:g} dB, but Psi assumes that levels are played as planned"
        problems.append(Problem("stimulus.rove_db", wrong, "0, or 0 in staircase.bayesian.trials"))
    # The limit of a training run may be lower: training needs no threshold.
    limits = {
        "staircase.trial_limit": protocol.staircase.trial_limit,
        "detection.trial_limit": protocol.detection.trial_limit if protocol.detection.frequencies_hz else 0,
    }
    for key, limit in limits.items():
        if 0 < limit < trials:
            wrong = f"is {limit}, and would end every such run before the {trials} trials of Psi"
            problems.append(Problem(key, wrong, f"0, or at least {trials}, as in staircase.bayesian.trials"))
    return problems


def _check_levels(protocol: StudyProtocol) -> list[Problem]:
    """Levels outside the staircases on directions, against the staircase's cap."""
    cap_n, practice, detection = protocol.staircase.cap_n, protocol.practice, protocol.detection
    highest_n = {
        "demo.level_n": highest_roved_n(protocol.demo.level_n, protocol.demo.rove_db),
        "practice.level_n": highest_roved_n(practice.level_n, practice.rove_db) if practice.frequencies_hz else 0.0,
        "detection.start_n": detection.start_n if detection.frequencies_hz else 0.0,
    }
    problems = []
    for key, level_n in highest_n.items():
        if level_n > cap_n + ROUNDING_N:
            roved = "" if key == "detection.start_n" else ", with its rove_db,"
            wrong = f"is {level_n:g} N{roved} above staircase.cap_n"
            problems.append(Problem(key, wrong, f"at most {cap_n} N, the cap"))
    return problems


def _check_times(protocol: StudyProtocol) -> list[Problem]:
    problems, limit_s = [], protocol.trial.time_limit_s
    if limit_s >= protocol.safety.longest_trial_s:
        wrong = f"is {limit_s} s, not below safety.longest_trial_s, which releases the device"
        allowed = f"below {protocol.safety.longest_trial_s} s, or 0 for none"
        problems.append(Problem("trial.time_limit_s", wrong, allowed))
    if frequencies := protocol.all_frequencies_hz:
        period_s = 1 / min(frequencies)
        if protocol.measurement.keep_s < period_s:
            wrong = f"is {protocol.measurement.keep_s} s, less than one period of the lowest frequency"
            # Rounded up, so that the time which the message allows is allowed.
            least_s = math.ceil(1e4 * period_s - 1e-6) / 1e4
            problems.append(Problem("measurement.keep_s", wrong, f"at least {least_s:g} s"))
    else:
        wrong = "is empty, and so are training, practice and detection: nothing would be played"
        problems.append(Problem("stimulus.frequencies_hz", wrong, "at least one frequency in one of them"))
    detection, fades_s = protocol.detection, protocol.stimulus.fade_in_s + protocol.stimulus.fade_out_s
    if detection.frequencies_hz and detection.interval_s <= fades_s:
        wrong = f"is {detection.interval_s} s, no longer than the fades together"
        problems.append(Problem("detection.interval_s", wrong, f"more than {fades_s:g} s"))
    return problems


def _check_names(protocol: StudyProtocol) -> list[Problem]:
    problems, buttons = [], protocol.trial.device_buttons
    if len(set(buttons)) not in (0, 2):
        problems.append(Problem("trial.device_buttons", f"is {list(buttons)}", "two different button numbers, or none"))
    for name, questions in (("before", protocol.before), ("debrief", protocol.debrief)):
        if len({question.key for question in questions}) < len(questions):
            problems.append(Problem(name, "uses a key twice", "a key of its own for every question"))
    return problems


def _check_declared(protocol: StudyProtocol) -> list[Problem]:
    problems, declared = [], protocol.analysis
    contrast, frequencies_hz = declared.contrast_hz, protocol.stimulus.frequencies_hz
    if contrast and (len(set(contrast)) != 2 or not set(contrast) <= set(frequencies_hz)):
        allowed = "two different ones of stimulus.frequencies_hz, or none"
        problems.append(Problem("analysis.contrast_hz", f"is {list(contrast)}", allowed))
    fitting = INTERVALS.get(declared.primary)
    if declared.interval not in ("undeclared", fitting):
        wrong = f"is {declared.interval}, while primary is {declared.primary}"
        allowed = f"{fitting}, or undeclared" if fitting else "undeclared, or declare primary, too"
        problems.append(Problem("analysis.interval", wrong, allowed))
    return problems
