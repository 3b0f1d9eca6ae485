"""Model error on clean recordings: the mismatch that the re-tuned model leaves on them, per cell and per channel.

Clean recordings are recordings of the same device without the fault. A mismatch of this size in the recordings to
diagnose counts as model error, not as evidence for an effect. `reference.learn_model_error` computes it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from analysis.diagnosis.data.spectral_lines import Band
from analysis.diagnosis.settings import LEARNED_TOO_MUCH
from analysis.wording import conjoin


class NothingLearned(ValueError):  # noqa: N818 - an answer that a user reads
    """The clean recordings cannot be compared with those to diagnose. Its text is a sentence without a full stop."""


@dataclass(frozen=True, slots=True)
class CleanFloor:
    """Shares of rms mismatch in the rms signal of clean recordings. Empty without clean recordings."""

    shares: Mapping[tuple[str, str, str, Band], float] = field(default_factory=dict)
    """Share of each cell: output, its quantity, input and octave."""
    channels: tuple[float, ...] = ()
    """Share of each channel over all octaves: those of the response, then those of the position."""
    error: str = ""
    """Name of the error measure, as in `diagnosis.json`."""
    recordings: int = 0
    """Number of clean recordings."""

    @property
    def beyond(self) -> float:
        """Factor on the largest observed share, because the next recording may exceed it: 1 + 1 / recordings."""
        return 1 + 1 / max(self.recordings, 1)

    def share(self, output: str, quantity: str, input: str, band_hz: Band) -> float:
        """Share of a cell. Where clean recordings never drove this input, the largest share of the same channel and
        octave; 0 without any."""
        cell_share = self.shares.get((output, quantity, input, band_hz))
        if cell_share is not None:
            return cell_share
        channel_shares = [s for (o, q, _, b), s in self.shares.items() if (o, q, b) == (output, quantity, band_hz)]
        return max(channel_shares, default=0.0)


def clean_floor_sentence(floor: CleanFloor, channels: Sequence[str]) -> str:
    """Sentence about the clean recordings; empty without any."""
    if not floor.channels:
        return ""
    shares = conjoin([f"{name} {100 * share:.2g} %" for name, share in zip(channels, floor.channels, strict=False)])
    count = f"{floor.recordings} clean recording{'s' if floor.recordings != 1 else ''}"
    text = (
        f"The difference between a device without faults and its re-tuned model was estimated from {count}: {shares} "
        f"of the channel's signal (the largest observed; in the map, times {floor.beyond:.2g}). This difference "
        "counts as noise here, with its distribution over frequency. An effect is named only where it explains more "
        f"than {floor.beyond:.2g} times as much of the diagnosed recordings as of a clean one."
    )
    if max(floor.channels) <= LEARNED_TOO_MUCH:
        return text
    return (
        f"{text} This is a large difference: a fault that the clean recordings also contain cannot be found, and "
        "small faults hardly can."
    )
