"""Who has taken part in a study, and which orders of the frequencies are still needed for a balanced sample.

A participant's number decides the row of a Williams design and whether the labels are swapped (`schedule`). Both come
round again after a cycle of participants, whose places are the cells of the design. A sample of n participants fills
the cells in turn; a cell whose participant withdrew or never finished stays short, because numbers are given once.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from protocols.definition.study_protocol import StudyProtocol
from protocols.procedure.schedule import frequency_order, labels_swapped, williams_rows

Progress = Literal["done", "begun", "left out"]


@dataclass(frozen=True, slots=True)
class Participant:
    """A participant of a study: code, number in the balanced order, and progress."""

    code: str
    number: int | None
    """The place in the balanced order, from 0; None where none was taken."""
    progress: Progress
    why: str = ""
    """Status of a participant who is left out: refused, excluded, withdrawn, unreadable."""


@dataclass(frozen=True, slots=True)
class Cell:
    """One order of the frequencies, with one labelling of the directions."""

    frequencies_hz: tuple[float, ...]
    swapped: bool
    """Whether the numbers 1 and 2 change places."""
    wanted: int
    """Participants of the whole sample."""
    done: int
    begun: int

    @property
    def needed(self) -> int:
        """Participants who have not begun."""
        return max(0, self.wanted - self.done - self.begun)


@dataclass(frozen=True, slots=True)
class StudyPlan:
    """Participants of a study so far, and the cells of its balanced design with the participants that each still
    needs."""

    protocol: str
    planned: int
    """The declared sample size; 0 where none is declared."""
    participants: tuple[Participant, ...]
    """Participants by their numbers, then those without."""
    cells: tuple[Cell, ...]
    """Orders of one cycle, as they are assigned; empty where orders are drawn at random or all are the same."""
    next_number: int
    """Number of the next participant."""

    def count(self, progress: Progress) -> int:
        """Number of participants with this progress, those without a place in the balanced order included."""
        return sum(each.progress == progress for each in self.participants)

    @property
    def next_cell(self) -> Cell | None:
        """Cell of the next participant: numbers beyond a cycle begin again at the first cell. None where `cells` is
        empty."""
        return self.cells[self.next_number % len(self.cells)] if self.cells else None

    @property
    def balanced_sizes(self) -> int:
        """Samples of a multiple of this size fill all cells equally often; 1 where nothing is balanced."""
        return max(1, len(self.cells))


def plan_study(protocol: StudyProtocol, participants: Sequence[Participant], next_number: int) -> StudyPlan:
    """The plan of a study: its cells with the participants that they have and need. participants: of this protocol.
    Where no sample size is declared, the cells of the cycles begun are wanted."""
    planned = protocol.analysis.participants
    cycle = _cycle(protocol)
    sample = planned or -(-max(next_number, 1) // cycle) * cycle
    cells = tuple(_cell(protocol, place, cycle, sample, participants) for place in range(cycle)) if cycle > 1 else ()
    return StudyPlan(protocol.name, planned, tuple(participants), cells, next_number)


def _cycle(protocol: StudyProtocol) -> int:
    """Participants after whom order and labelling repeat."""
    frequencies, settings = protocol.stimulus.frequencies_hz, protocol.schedule
    orders = len(williams_rows(len(frequencies))) if settings.order == "williams" and frequencies else 1
    return orders * (1 if settings.labels == "fixed" else 2)


def _cell(protocol: StudyProtocol, place: int, cycle: int, sample: int, participants: Sequence[Participant]) -> Cell:
    frequencies_hz = protocol.stimulus.frequencies_hz
    drawn = protocol.schedule.order == "random"
    here = [each for each in participants if each.number is not None and each.number % cycle == place]
    return Cell(
        () if drawn else frequency_order(protocol.schedule, frequencies_hz, 0, place),
        labels_swapped(protocol.schedule, len(frequencies_hz), place),
        len(range(place, sample, cycle)),
        sum(each.progress == "done" for each in here),
        sum(each.progress == "begun" for each in here),
    )
