"""Interface of an equalizer, through which a stimulus passes on its way to the device."""

from typing import Protocol

from equalizer.signals.signal import FloatArray, Signal


class Equalizer(Protocol):
    """Turns a signal wanted at the handle into commands."""

    @property
    def name(self) -> str:
        """Name that a session's log states for it: "none (commanded force)", or kind, order and band of the model."""
        ...

    @property
    def takes(self) -> str:
        """The quantity that `periodic` expects: "force" or "acceleration"."""
        ...

    def periodic(self, wanted: Signal) -> Signal:
        """One loop of the command, for one loop of the wanted signal. Both are whole periods and are repeated."""
        ...

    def onset(self, wanted: Signal, envelope: FloatArray) -> Signal | None:
        """The command that leads from rest into the loop while the wanted signal, one loop, rises by `envelope`,
        shape (ticks,), 0 to 1; None where the loop's command times the envelope does that."""
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
        return None
