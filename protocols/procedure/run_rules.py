"""Staircase rule of a run by its phase: training has another trial limit than the test, detection another start level
and trial limit.
"""

from dataclasses import replace

from protocols.definition.staircase_rule import StaircaseRule
from protocols.definition.study_protocol import StudyProtocol
from protocols.trial import Phase


def make_staircase_rule(protocol: StudyProtocol, phase: Phase) -> StaircaseRule:
    """Make the rule of a staircase run. A limit of 0 in training or detection means that of the protocol's staircase.

    Not for practice runs, whose phase is TRAINING too: they follow no staircase (`protocols.procedure.practice`).
    Raises ValueError for CATCH: catch trials lie within test runs and follow no staircase.
    """
    match phase:
        case Phase.TEST:
            return protocol.staircase
        case Phase.TRAINING:
            trial_limit = protocol.training.trial_limit
            return replace(protocol.staircase, trial_limit=trial_limit) if trial_limit else protocol.staircase
        case Phase.DETECTION:
            trial_limit = protocol.detection.trial_limit or protocol.staircase.trial_limit
            return replace(protocol.staircase, start_n=protocol.detection.start_n, trial_limit=trial_limit)
        case Phase.CATCH:
            raise ValueError("catch trials follow no staircase")
