"""Outcomes of ambiguous diagnoses after one further recording, proposed by the diagnosis or drawn at random.

A diagnosis is ambiguous if it returned several effects although the device has a single one. The comparison shows
whether the proposed recordings discriminate between effects better than random ones. `study.evaluation.bank.follow_up`
makes the recordings and the `FollowUp`s.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from analysis.evaluation.blind_test.confidence_intervals import IntervalEstimate, compute_share


@dataclass(frozen=True, slots=True)
class FollowUp:
    """A device with a single concealed effect, for whose first recording the diagnosis returned several effects."""

    number: int
    """Number of the test case in its bank of cases."""
    effect: str
    """Name of the concealed effect."""
    returned: tuple[str, ...]
    """Effects that the diagnosis returned from the first recording."""
    proposed: str
    """Description of the proposed recording; empty if no recording of the diagnosis's menu of experiments would
    discriminate."""
    after_proposed: tuple[str, ...]
    """Effects returned from the first and the proposed recording together; empty if none was proposed."""
    drawn: str
    """Description of the recording drawn at random from the same menu; it may be the proposed one."""
    after_drawn: tuple[str, ...]
    """Effects returned from the first and the random recording together."""

    @property
    def resolved(self) -> bool:
        """Whether only the concealed effect is returned after the proposed recording."""
        return self.after_proposed == (self.effect,)

    @property
    def resolved_by_chance(self) -> bool:
        """Whether only the concealed effect is returned after the random recording."""
        return self.after_drawn == (self.effect,)


def compute_follow_up_figures(follow_ups: Sequence[FollowUp]) -> tuple[IntervalEstimate, ...]:
    """Compute the shares of ambiguous diagnoses that the proposed or the random recording resolved: of all, where a
    missing proposal counts as unresolved, then of those with a proposal."""
    with_proposal = [follow_up for follow_up in follow_ups if follow_up.proposed]
    return (
        compute_share(
            "several names, the right one left by the proposed recording",
            follow_ups,
            lambda follow_up: follow_up.resolved,
        ),
        compute_share(
            "several names, the right one left by a random recording",
            follow_ups,
            lambda follow_up: follow_up.resolved_by_chance,
        ),
        compute_share(
            "the same where one is proposed, by the proposed", with_proposal, lambda follow_up: follow_up.resolved
        ),
        compute_share(
            "the same where one is proposed, by a random one",
            with_proposal,
            lambda follow_up: follow_up.resolved_by_chance,
        ),
    )
