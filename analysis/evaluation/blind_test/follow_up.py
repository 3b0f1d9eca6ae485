"""Outcomes of ambiguous answers after one further recording, proposed or drawn at random."""

from collections.abc import Sequence
from dataclasses import dataclass

from analysis.evaluation.blind_test.confidence_intervals import Figure, share


@dataclass(frozen=True, slots=True)
class FollowUp:
    """A device with a single effect, whose first recording left several names."""

    number: int
    effect: str
    """The concealed one."""
    returned: tuple[str, ...]
    """Effects that were returned before the follow-up."""
    proposed: str
    """Proposed recording, in the diagnosis's words; empty where no recording of its menu would discriminate."""
    after_proposed: tuple[str, ...]
    """The returned set with that recording beside the first; empty where none was proposed."""
    drawn: str
    """A recording drawn at random from the menu; it may be the proposed one."""
    after_drawn: tuple[str, ...]

    @property
    def resolved(self) -> bool:
        """Whether the concealed effect alone is left after the proposed recording."""
        return self.after_proposed == (self.effect,)

    @property
    def resolved_by_chance(self) -> bool:
        """Whether the concealed effect alone is left after the recording drawn at random."""
        return self.after_drawn == (self.effect,)


def follow_up_figures(found: Sequence[FollowUp]) -> tuple[Figure, ...]:
    """Shares of ambiguous answers that a further recording resolved, proposed or random: of all, and of those with a
    proposal."""
    asked = [each for each in found if each.proposed]
    return (
        share("several names, the right one left by the proposed recording", found, lambda each: each.resolved),
        share("several names, the right one left by a random recording", found, lambda each: each.resolved_by_chance),
        share("the same where one is proposed, by the proposed", asked, lambda each: each.resolved),
        share("the same where one is proposed, by a random one", asked, lambda each: each.resolved_by_chance),
    )
