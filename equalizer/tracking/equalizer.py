"""The equalizer's port: what a stimulus passes through on its way to the device."""

from typing import Protocol

from equalizer.signals.signal import Signal


class Equalizer(Protocol):
    """Turns what is wanted at the handle into what is commanded."""

    @property
    def name(self) -> str: ...

    @property
    def takes(self) -> str:
        """The quantity that `periodic` expects: "force" or "acceleration"."""
        ...

    def periodic(self, wanted: Signal) -> Signal:
        """One loop of the command, for one loop of the wanted signal. Both are whole periods and are repeated."""
        ...


class Identity:
    """No equalizer: the wanted force is the commanded force, as in the published study."""

    name = "none (commanded force)"
    takes = "force"

    def periodic(self, wanted: Signal) -> Signal:
        if wanted.quantity != "force":
            raise ValueError(f"without an equalizer only a force can be played, not {wanted.quantity}")
        return wanted
