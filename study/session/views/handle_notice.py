"""Notice before a real device moves by itself: who may touch it."""

from protocols.definition.recording_protocol import RecordingProtocol


def handle_notice(protocol: RecordingProtocol, device: str, total_s: float) -> str:
    """The notice. total_s: duration if nothing is repeated."""
    peak_n = max(segment.amplitude_n for segment in protocol.segments)
    for_how_long = f"for about {round(total_s / 60)} min" if total_s >= 60 else f"for about {max(1, round(total_s))} s"
    if protocol.hand == "held":
        return (
            f"'{protocol.name}' is played into a hand: hold the handle of '{device}' now, as lightly and as evenly as "
            f"in the study, {for_how_long}. It will push with up to {peak_n:g} N. Letting go is always safe; Ctrl-C "
            "stops."
        )
    return (
        f"No person may hold the handle: '{device}' is going to move by itself {for_how_long}, pushed with up to "
        f"{peak_n:g} N and held at its place by a weak spring. Keep hands away and the workspace free; Ctrl-C stops."
    )
