"""Seats for the display contract: a display, and the participant before it.

Another kind of display joins by one more factory in SEATS. A seat takes what the person will do beforehand, in order,
in keys ("1", "q", "enter") where all displays have the same, else in words of its own (`fill`, `withdraw`).
"""

import io
import os
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Protocol

import pytest

from protocols.trial import Phase
from study.devices.clock import Clock, RealClock, VirtualClock
from study.participants.observer_catalogue import find_observer
from study.session.state.due_trial import PresentTrial
from study.session.views.form_views import Form
from study.tui.line_mode.line_input import LineInput
from study.tui.line_mode.plain_display import PlainDisplay
from study.workflows.session.simulated_display import SimulatedDisplay
from study.workflows.trial.display import Display


class Seat(Protocol):
    display: Display
    clock: Clock
    person: bool
    """False: keys reach no participant, who does as it was made to."""

    def press(self, *keys: str) -> None: ...

    def fill(self, form: Form, answers: tuple[str, ...]) -> None:
        """Answer the next form's fields, in order, and hand it in."""
        ...

    def withdraw(self) -> None:
        """Withdraw the consent during the next pause, and confirm it."""
        ...


class PlainSeat:
    person = True

    def __init__(self) -> None:
        read, self._write = os.pipe()
        self.clock: Clock = RealClock()
        self.display: Display = PlainDisplay(LineInput(read), io.StringIO(), self.clock)
        self._read = read

    def press(self, *keys: str) -> None:
        self._type(*("" if key == "enter" else key for key in keys))

    def fill(self, form: Form, answers: tuple[str, ...]) -> None:
        self._type(*answers)

    def withdraw(self) -> None:
        self._type("w", "withdraw")

    def close(self) -> None:
        os.close(self._write)
        os.close(self._read)

    def _type(self, *lines: str) -> None:
        os.write(self._write, "".join(f"{line}\n" for line in lines).encode())


class SimulatedSeat:
    person = False

    def __init__(self) -> None:
        self.clock: Clock = VirtualClock()
        display = SimulatedDisplay(find_observer("ideal", 1), 1, self.clock)
        stimulus = PresentTrial(0, 0, 0, Phase.TEST, 25.0, 0.0, 1.0, label=1, direction=1, angle_deg=45.0, polarity=1)
        display.feel(stimulus, answers_before=0)
        self.display: Display = display

    def press(self, *keys: str) -> None:
        return None

    def fill(self, form: Form, answers: tuple[str, ...]) -> None:
        return None

    def withdraw(self) -> None:
        return None


@contextmanager
def plain_seat() -> Iterator[Seat]:
    seat = PlainSeat()
    try:
        yield seat
    finally:
        seat.close()


@contextmanager
def simulated_seat() -> Iterator[Seat]:
    yield SimulatedSeat()


SEATS: dict[str, Callable[[], AbstractContextManager[Seat]]] = {
    "line mode": plain_seat,
    "simulated participant": simulated_seat,
}


@pytest.fixture(params=SEATS)
def seat(request) -> Iterator[Seat]:
    with SEATS[request.param]() as taken:
        yield taken


@pytest.fixture(params=[name for name in SEATS if name != "simulated participant"])
def persons_seat(request) -> Iterator[Seat]:
    with SEATS[request.param]() as taken:
        yield taken
