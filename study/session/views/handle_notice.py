"""Safety notices before a real device moves: whether a hand may be on the handle, largest force, duration."""

from collections.abc import Callable

from protocols.definition.recording_protocol import RecordingProtocol
from study.errors import StudyError

BeforeMoving = Callable[[str], None]
"""Shows a notice to the people around a real device. If it raises an exception, the device does not move."""


def refuse_unannounced(notice: str) -> None:
    """Raise StudyError, so that the device does not move: the `BeforeMoving` of callers that cannot show a notice."""
    raise StudyError(
        "The device was not moved",
        f"A real device would move without a warning. {notice}",
        "Use the command, which asks first; from Python, give before_moving.",
        saved="Nothing moved.",
    )


def format_recording_notice(protocol: RecordingProtocol, device: str, total_s: float) -> str:
    """Format the notice before a recording. device: name of the device; total_s: duration (s) if no segment is
    repeated."""
    peak_n = max(segment.amplitude_n for segment in protocol.segments)
    if protocol.hand == "held":
        return (
            f"'{protocol.name}' is played into a hand: hold the handle of '{device}' now, as lightly and as evenly as "
            f"in the study, {_describe_duration(total_s)}. It will push with up to {peak_n:g} N. Letting go is always "
            "safe; Ctrl-C stops."
        )
    return format_free_handle_notice(device, peak_n, total_s)


def format_free_handle_notice(device: str, peak_n: float, total_s: float) -> str:
    """Format the notice before a device moves a handle that no hand holds. peak_n: largest force (N); total_s: duration
    (s)."""
    return (
        f"No person may hold the handle: '{device}' is going to move by itself {_describe_duration(total_s)}, "
        f"pushed with up to {peak_n:g} N and held at its place by a weak spring. Keep hands away and the "
        "workspace free; Ctrl-C stops."
    )


def format_limit_test_notice(device: str, force_n: float) -> str:
    """Format the notice before the test of a device's force cap and watchdog (`study.devices.opening.accept_device`),
    during which the virtual spring is off, so that the handle moves freely. force_n: force of the test (N)."""
    return (
        f"No person may hold the handle: within some seconds '{device}' is shaken along x for a quarter of a second, "
        f"by {force_n:g} N, or twice as much where its cap does not hold; then it is pushed along x with {force_n:g} N "
        "for a tenth of a second, and moves by some 15 mm. Keep hands away and the workspace free."
    )


def _describe_duration(total_s: float) -> str:
    """Describe a duration (s) in words: from 60 s on in whole minutes, else in whole seconds, at least 1."""
    return f"for about {round(total_s / 60)} min" if total_s >= 60 else f"for about {max(1, round(total_s))} s"
