"""Outcomes of ambiguous answers after one further recording, either proposed by the diagnosis or drawn at random.

The comparison shows whether the proposed recordings discriminate rivals better than chance.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from analysis.evaluation.blind_test.confidence_intervals import Figure, share


@dataclass(frozen=True, slots=True)
class FollowUp:
    """A device with a single concealed effect, whose first recording left several names."""

    number: int
    """Number of the case in its bank."""
    effect: str
    """Name of the concealed effect."""
    returned: tuple[str, ...]
    """Effects that were returned before the follow-up."""
    proposed: str
    """Proposed recording, in the diagnosis's words; empty where no recording of its menu would discriminate."""
    after_proposed: tuple[str, ...]
    """Effects returned from both recordings, the first and the proposed one; empty where none was proposed."""
    drawn: str
    """A recording drawn at random from the menu; it may be the proposed one."""
    after_drawn: tuple[str, ...]
    """Effects returned from both recordings, the first and the drawn one."""

    @property
    def resolved(self) -> bool:
        """Whether the concealed effect alone is left after the proposed recording."""
        return self.after_proposed == (self.effect,)

    @property
    def resolved_by_chance(self) -> bool:
        """Whether the concealed effect alone is left after the recording drawn at random."""
        return self.after_drawn == (self.effect,)


def compute_follow_up_figures(follow_ups: Sequence[FollowUp]) -> tuple[Figure, ...]:
    """Shares of ambiguous answers that the proposed or the random recording resolved: of all answers, and of those with
    a proposal."""
    with_proposal = [follow_up for follow_up in follow_ups if follow_up.proposed]
    return (
        share(
            "several names, the right one left by the proposed recording",
            follow_ups,
            lambda follow_up: follow_up.resolved,
        ),
        share(
            "several names, the right one left by a random recording",
            follow_ups,
            lambda follow_up: follow_up.resolved_by_chance,
        ),
        share("the same where one is proposed, by the proposed", with_proposal, lambda follow_up: follow_up.resolved),
        share(
            "the same where one is proposed, by a random one",
            with_proposal,
            lambda follow_up: follow_up.resolved_by_chance,
        ),
    )
