from dataclasses import replace

import numpy as np
import pytest

from equalizer.signals.joining import join_recordings
from equalizer.signals.recording import Hold, Recording, Segment
from equalizer.signals.signal import Signal


def part(n: int, level: float, kind: str = "sine") -> Recording:
    force = Signal(np.full((n, 1), level), 1000.0, "force", "N", ("fx",))
    acceleration = Signal(np.full((n, 1), -level), 1000.0, "acceleration", "m/s^2", ("ax",))
    return Recording("a device", force, acceleration, segments=(Segment(2, n, kind),))


def test_parts_follow_each_other_and_their_segments_move_along():
    whole = join_recordings([part(10, 1.0), part(5, 2.0, "sweep")], {"place": "here"})
    assert whole.command.samples[:, 0].tolist() == [1.0] * 10 + [2.0] * 5
    assert whole.segments == (Segment(2, 10, "sine"), Segment(12, 15, "sweep"))
    assert whole.meta == {"place": "here"}


def test_a_position_that_one_part_lacks_is_left_out():
    with_position = replace(part(4, 1.0), position=Signal(np.zeros((4, 1)), 1000.0, "position", "m", ("x",)))
    assert join_recordings([with_position, part(4, 1.0)], {}).position is None
    assert join_recordings([with_position, with_position], {}).position is not None


def test_conditions_follow_each_other():
    warm = replace(part(4, 1.0), condition=Signal(np.full((4, 1), 293.0), 1000.0, "temperature", "K", ("motor",)))
    assert len(join_recordings([warm, warm], {}).condition) == 8


def test_nothing_cannot_be_joined():
    with pytest.raises(ValueError, match="nothing to join"):
        join_recordings([], {})


def test_recordings_of_two_devices_cannot_be_joined():
    with pytest.raises(ValueError, match="of another at 1000 Hz cannot follow one of a device"):
        join_recordings([part(4, 1.0), replace(part(4, 1.0), device="another")], {})


def test_recordings_whose_commands_are_held_differently_cannot_be_joined():
    """The joined recording has a single hold: a model would be fitted to a command that one part did not have."""
    with pytest.raises(ValueError, match="command held by linear cannot follow one held by zero-order"):
        join_recordings([part(4, 1.0), replace(part(4, 1.0), hold=Hold.LINEAR)], {})
