"""When the bell rings."""

import pytest

from study.session.watching.watch_view import Alarm
from study.tui.watch.watch_screen import BELL_INTERVAL_S, AlarmBook

CLIPPED = Alarm("sensor", "clipped", "10:00")
QUIET = Alarm("time near", "80 %", "10:00", urgent=False)
NUMB = Alarm("adverse", "numb", "10:00", event=True)
PAIN = Alarm("adverse", "pain", "10:05", event=True)


@pytest.fixture
def book():
    return AlarmBook()


def test_a_new_alarm_rings_at_once_and_again_until_it_is_seen(book):
    assert book.update([CLIPPED], 0.0)
    assert not book.update([CLIPPED], BELL_INTERVAL_S - 0.1)
    assert book.update([CLIPPED], BELL_INTERVAL_S)
    assert book.acknowledge(BELL_INTERVAL_S) == 1
    assert not book.update([CLIPPED], 3 * BELL_INTERVAL_S)
    assert (book.new_alarms, book.acknowledged_alarms) == ((), (CLIPPED,))


def test_one_that_is_not_urgent_rings_once(book):
    assert book.update([QUIET], 0.0)
    assert not any(book.update([QUIET], second) for second in range(1, 60))
    assert book.new_alarms == (QUIET,)


def test_a_second_alarm_rings_although_the_first_was_seen(book):
    book.update([CLIPPED], 0.0)
    book.acknowledge(0.5)
    assert book.update([CLIPPED, QUIET], 1.0)
    assert (book.new_alarms, book.acknowledged_alarms) == ((QUIET,), (CLIPPED,))


def test_an_alarm_that_flickers_stays_seen_and_one_that_comes_back_later_rings(book):
    book.update([CLIPPED], 0.0)
    book.acknowledge(0.5)
    assert not book.update([], 1.0)
    assert not book.update([CLIPPED], 2.0)
    book.update([], 20.0)
    assert book.update([CLIPPED], 21.0)


def test_each_event_is_an_alarm_of_its_own(book):
    book.update([NUMB], 0.0)
    book.acknowledge(0.5)
    assert book.update([PAIN], 1.0)
    assert book.new_alarms == (PAIN,)


def test_without_alarms_there_is_nothing_to_be_seen(book):
    assert not book.update([], 0.0)
    assert book.acknowledge(0.0) == 0
