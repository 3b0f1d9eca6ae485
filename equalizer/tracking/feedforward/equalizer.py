"""Interface of an equalizer, and the identity as its trivial form.

An equalizer computes the commands (forces) that produce a wanted signal at the handle. A study plays every stimulus
through an equalizer, so that the same protocol runs with a commanded force or with a wanted acceleration.
"""

from typing import Protocol

from equalizer.signals.signal import FloatArray, Signal


class Equalizer(Protocol):
    """Computes commands from the signal that is wanted at the handle."""

    @property
    def name(self) -> str:
        """Name of the equalizer in a session's log: "none (commanded force)", or kind, order and band of the model."""
        ...

    @property
    def takes(self) -> str:
        """The quantity that `periodic` expects: "force" or "acceleration"."""
        ...

    def periodic(self, wanted: Signal) -> Signal:
        """One loop (N, channels) of the command for one loop of the wanted signal. Both loops are a whole number of
        periods long and are repeated."""
        ...

    def onset(self, wanted: Signal, envelope: FloatArray) -> Signal | None:
        """The command (ticks, channels) from rest into the loop, while the wanted signal (one loop) is multiplied by
        `envelope` (ticks,), which rises from 0 to 1. None: the loop's command times the envelope is to be used."""
        ...


class Identity:
    """No equalizer: the wanted force is the commanded force, as in the published study."""

    name = "none (commanded force)"
    takes = "force"

    def periodic(self, wanted: Signal) -> Signal:
        """The wanted force itself. Raises ValueError for another quantity than force."""
        if wanted.quantity != "force":
            raise ValueError(f"without an equalizer only a force can be played, not {wanted.quantity}; give a model")
        return wanted

    def onset(self, wanted: Signal, envelope: FloatArray) -> None:
        # The command is the wanted force times the envelope.
        return None
