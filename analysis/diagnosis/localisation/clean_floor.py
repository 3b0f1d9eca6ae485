"""The mismatch that a model leaves on clean recordings, by cell and by channel; it counts as model error, not as
evidence for an effect."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from analysis.diagnosis.data.spectral_lines import Band
from analysis.diagnosis.settings import LEARNED_TOO_MUCH
from analysis.wording import conjoin


class NothingLearned(ValueError):  # noqa: N818 - an answer that a user reads
    """The clean recordings cannot be compared with those to diagnose; a sentence without a full stop."""


@dataclass(frozen=True, slots=True)
class CleanFloor:
    """Rms mismatch over the rms signal of clean recordings, raised by `beyond`."""

    shares: Mapping[tuple[str, str, str, Band], float] = field(default_factory=dict)
    """Shares by output, its quantity, input and octave."""
    channels: tuple[float, ...] = ()
    """Shares by channel, the response's and then the position's, over all octaves. Empty without clean recordings."""
    error: str = ""
    """Name of the error measure, as in `diagnosis.json`."""
    recordings: int = 0

    @property
    def beyond(self) -> float:
        """Factor by which the largest observed share was raised; larger for fewer recordings."""
        return 1 + 1 / max(self.recordings, 1)

    def share(self, output: str, quantity: str, input: str, band_hz: Band) -> float:
        """Share of a cell; the largest of the channel's octave where clean recordings never drove this input; else
        0."""
        own = self.shares.get((output, quantity, input, band_hz))
        if own is not None:
            return own
        beside = [s for (o, q, _, b), s in self.shares.items() if (o, q, b) == (output, quantity, band_hz)]
        return max(beside, default=0.0)


def clean_floor_sentence(floor: CleanFloor, channels: Sequence[str]) -> str:
    """Sentence about the clean recordings; empty without any."""
    if not floor.channels:
        return ""
    shares = conjoin([f"{name} {100 * share:.2g} %" for name, share in zip(channels, floor.channels, strict=False)])
    count = f"{floor.recordings} clean recording{'s' if floor.recordings != 1 else ''}"
    text = (
        f"What a device in order differs by from its re-tuned model was learned from {count}: {shares} of the "
        f"channel's signal (the largest that was seen; in the map, times {floor.beyond:.2g}). So much counts as noise "
        "here, more of it where in frequency more of it lies. Named is only what explains more of what is diagnosed "
        f"than {floor.beyond:.2g} times what it explains of a clean recording."
    )
    if max(floor.channels) <= LEARNED_TOO_MUCH:
        return text
    return f"{text} That is much: what the clean recordings hold, too, cannot be found, and little faults hardly can."
