"""Staircase rule of a run: training and detection differ from the test runs."""

from dataclasses import replace

from protocols.definition.staircase_rule import StaircaseRule
from protocols.definition.study_protocol import StudyProtocol
from protocols.trial import Phase


def make_staircase_rule(protocol: StudyProtocol, phase: Phase) -> StaircaseRule:
    """The rule of a staircase run. Practice runs, at a fixed level, have none: see `protocols.procedure.practice`.

    Raises ValueError for CATCH: catch trials lie within test runs and follow no staircase.
    """
    match phase:
        case Phase.TEST:
            return protocol.staircase
        case Phase.TRAINING:
            limit = protocol.training.trial_limit
            return replace(protocol.staircase, trial_limit=limit) if limit else protocol.staircase
        case Phase.DETECTION:
            limit = protocol.detection.trial_limit or protocol.staircase.trial_limit
            return replace(protocol.staircase, start_n=protocol.detection.start_n, trial_limit=limit)
        case Phase.CATCH:
            raise ValueError("catch trials follow no staircase")
