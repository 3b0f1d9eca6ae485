"""The mismatch that a model leaves on clean recordings, by cell and by channel, which is no evidence for an effect."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from analysis.diagnosis.data.frequency_cells import Band


@dataclass(frozen=True, slots=True)
class CleanFloor:
    """Rms mismatch over the rms signal of clean recordings, raised by `beyond`."""

    shares: Mapping[tuple[str, str, str, Band], float] = field(default_factory=dict)
    """By output, its quantity, input and octave."""
    channels: tuple[float, ...] = ()
    """By channel, the response's and then the position's, over all octaves. Empty where nothing was learned."""
    error: str = ""
    """How it was measured, as `diagnosis.json` says it."""
    recordings: int = 0

    @property
    def beyond(self) -> float:
        """Factor by which the largest observed share was raised: the fewer recordings, the more."""
        return 1 + 1 / max(self.recordings, 1)

    def share(self, output: str, quantity: str, input: str, band_hz: Band) -> float:
        """Share of a cell; the largest of the channel's octave where clean recordings never drove this input; else
        0."""
        own = self.shares.get((output, quantity, input, band_hz))
        if own is not None:
            return own
        beside = [s for (o, q, _, b), s in self.shares.items() if (o, q, b) == (output, quantity, band_hz)]
        return max(beside, default=0.0)
