"""Model error on clean recordings: relative error of the re-tuned model, per channel and per cell of the mismatch map.

Clean recordings are recordings of the same device without the fault. A mismatch of this size in the recordings to
diagnose counts as model error, not as evidence for an effect: it is the floor of the significance test in
`mismatch_cells`. `reference.learn_model_error` computes it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from analysis.diagnosis.data.spectral_lines import Band
from analysis.diagnosis.limits import LARGEST_LEARNED_SHARE
from analysis.wording import conjoin


class IncomparableRecordingsError(ValueError):
    """The clean recordings have another error measure than those to diagnose. The text is a sentence without a full
    stop."""


@dataclass(frozen=True, slots=True)
class ModelErrorFloor:
    """Relative model errors on the clean recordings: rms mismatch over rms signal. Empty without clean recordings."""

    shares: Mapping[tuple[str, str, str, Band], float] = field(default_factory=dict)
    """Relative error of each cell: output channel, its quantity, input channel and octave (Hz)."""
    channels: tuple[float, ...] = ()
    """Relative error of each channel over all octaves: channels of the response, then of the position."""
    error: str = ""
    """Name of the error measure, as in `diagnosis.json`."""
    recordings: int = 0
    """Number of clean recordings."""

    @property
    def margin_factor(self) -> float:
        """Factor on the largest observed share, because the next recording may exceed it: 1 + 1 / recordings. Chosen by
        hand."""
        return 1 + 1 / max(self.recordings, 1)

    def get_share(self, output: str, quantity: str, input: str, band_hz: Band) -> float:
        """Get the relative error of a cell; where the clean recordings have no such cell, the largest of the same
        output channel and octave; 0 without any."""
        cell_share = self.shares.get((output, quantity, input, band_hz))
        if cell_share is not None:
            return cell_share
        channel_shares = [
            share
            for (channel_output, channel_quantity, _, octave), share in self.shares.items()
            if (channel_output, channel_quantity, octave) == (output, quantity, band_hz)
        ]
        return max(channel_shares, default=0.0)


def describe_model_error_floor(floor: ModelErrorFloor, channels: Sequence[str]) -> str:
    """Describe the model error on the clean recordings in sentences; empty without any. channels: names, in the order
    of `ModelErrorFloor.channels`."""
    if not floor.channels:
        return ""
    shares = conjoin([f"{name} {100 * share:.2g} %" for name, share in zip(channels, floor.channels, strict=False)])
    source = f"{floor.recordings} clean recording{'s' if floor.recordings != 1 else ''}"
    text = (
        f"The difference between a device without faults and its re-tuned model was estimated from {source}: {shares} "
        f"of the channel's signal (the largest observed; in the map, times {floor.margin_factor:.2g}). This difference "
        "counts as noise here, with its distribution over frequency. An effect is named only where it explains more "
        f"than {floor.margin_factor:.2g} times as much of the diagnosed recordings as of a clean one."
    )
    if max(floor.channels) <= LARGEST_LEARNED_SHARE:
        return text
    return (
        f"{text} This is a large difference: a fault that the clean recordings also contain cannot be found, and "
        "small faults hardly can."
    )
