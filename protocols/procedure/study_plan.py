"""Progress of a study's participants, and the orders of the frequencies that a balanced sample still needs.

The order of the frequencies is counterbalanced by a Williams design (`schedule.make_williams_rows`). A participant's
number determines the row of the design and whether the labels 1 and 2 of the directions are swapped. Both repeat after
a cycle of participants; each position in the cycle is a cell of the design. A sample of n participants fills the cells
in turn. A cell whose participant is left out lacks a participant, because a number is never assigned again.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from protocols.definition.study_protocol import StudyProtocol
from protocols.procedure.schedule import are_labels_swapped, make_williams_rows, order_frequencies

Progress = Literal["done", "begun", "left out"]
"""Whether a participant finished, has begun, or does not count towards the sample."""


@dataclass(frozen=True, slots=True)
class Participant:
    """A participant of a study: code, number in the balanced order, and progress."""

    code: str
    number: int | None
    """Position in the balanced order, from 0; None where none was assigned."""
    progress: Progress
    reason: str = ""
    """Reason why a participant is left out, such as refused, excluded, withdrawn or unreadable; "running" where a
    session is running, which cannot be resumed; else empty."""


@dataclass(frozen=True, slots=True)
class Cell:
    """One order of the frequencies, with one labelling of the directions, and its numbers of participants."""

    frequencies_hz: tuple[float, ...]
    """Frequencies in the order of their runs; empty where the order is drawn at random."""
    swapped: bool
    """Whether the labels 1 and 2 of the directions are swapped."""
    required: int
    """Number of participants that the whole sample requires in this cell."""
    done: int
    """Participants who have finished."""
    begun: int
    """Participants who have begun and not finished."""

    @property
    def needed(self) -> int:
        """Number of participants who still have to begin."""
        return max(0, self.required - self.done - self.begun)


@dataclass(frozen=True, slots=True)
class StudyPlan:
    """Participants of a study so far, and the cells of its balanced design with the number of participants that each
    still needs."""

    protocol: str
    """Name of the protocol."""
    planned: int
    """The declared sample size; 0 where none is declared."""
    participants: tuple[Participant, ...]
    """Participants in the order in which they were given."""
    cells: tuple[Cell, ...]
    """Cells of one cycle in the order in which they are assigned; empty where a cycle is one participant, so that
    nothing is balanced."""
    next_number: int
    """Position of the next participant in the balanced order, from 0."""

    def count(self, progress: Progress) -> int:
        """Count the participants with this progress, including those without a position in the balanced order."""
        return sum(participant.progress == progress for participant in self.participants)

    @property
    def next_cell(self) -> Cell | None:
        """Cell of the next participant; after the last cell of the cycle, the first follows. None where `cells` is
        empty."""
        return self.cells[self.next_number % len(self.cells)] if self.cells else None

    @property
    def cycle_length(self) -> int:
        """Number of participants in a cycle: samples of a multiple of it fill all cells equally often; 1 where nothing
        is balanced."""
        return max(1, len(self.cells))


def plan_study(protocol: StudyProtocol, participants: Sequence[Participant], next_number: int) -> StudyPlan:
    """Make the plan of a study: its cells with the numbers of participants that they have and need. participants: those
    of this protocol; next_number: number of the next participant, from 0. Where the protocol declares no sample size,
    the cells require complete cycles for `next_number` participants, at least one cycle."""
    planned = protocol.analysis.participants
    cycle_length = _find_cycle_length(protocol)
    sample_size = planned or -(-max(next_number, 1) // cycle_length) * cycle_length
    cells = (
        tuple(
            _make_cell(protocol, cycle_index, cycle_length, sample_size, participants)
            for cycle_index in range(cycle_length)
        )
        if cycle_length > 1
        else ()
    )
    return StudyPlan(protocol.name, planned, tuple(participants), cells, next_number)


def _find_cycle_length(protocol: StudyProtocol) -> int:
    """Compute the number of participants after which order of frequencies and labelling repeat."""
    frequencies_hz, settings = protocol.stimulus.frequencies_hz, protocol.schedule
    order_count = len(make_williams_rows(len(frequencies_hz))) if settings.order == "williams" and frequencies_hz else 1
    return order_count * (1 if settings.labels == "fixed" else 2)


def _make_cell(
    protocol: StudyProtocol, cycle_index: int, cycle_length: int, sample_size: int, participants: Sequence[Participant]
) -> Cell:
    """Make the cell of this index in the cycle; all participants of the cell count, also those beyond the sample."""
    frequencies_hz = protocol.stimulus.frequencies_hz
    is_random = protocol.schedule.order == "random"
    cell_participants = [
        participant
        for participant in participants
        if participant.number is not None and participant.number % cycle_length == cycle_index
    ]
    return Cell(
        () if is_random else order_frequencies(protocol.schedule, frequencies_hz, 0, cycle_index),
        are_labels_swapped(protocol.schedule, len(frequencies_hz), cycle_index),
        len(range(cycle_index, sample_size, cycle_length)),
        sum(participant.progress == "done" for participant in cell_participants),
        sum(participant.progress == "begun" for participant in cell_participants),
    )
