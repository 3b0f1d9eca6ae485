"""Interface of an equalizer, and the identity as its trivial form.

An equalizer computes the commands (forces) that produce a reference signal at the handle.
`study.session.stimulus.stimulus` passes every stimulus through an equalizer, so that the same protocol runs with a
commanded force or with a reference acceleration. The other implementation is `model_equalizer.ModelEqualizer`.
"""

from typing import Protocol

from equalizer.signals.signal import FloatArray, Signal


class Equalizer(Protocol):
    """Computes commands (forces, N) from the reference signal, which the handle is to follow."""

    @property
    def name(self) -> str:
        """Name of the equalizer in a session's log: "none (commanded force)", or kind, order and band of the model."""
        ...

    @property
    def reference_quantity(self) -> str:
        """Quantity of the reference signal that the two methods expect: "force" or "acceleration"."""
        ...

    def compute_loop_commands(self, reference: Signal) -> Signal:
        """Compute one loop (N, channels) of the command for one loop (N, channels) of the reference signal. Both loops
        are a whole number of periods long and are repeated."""
        ...

    def compute_onset_commands(self, reference: Signal, envelope: FloatArray) -> Signal | None:
        """Compute the command (ticks, channels) from rest into the loop, while the reference signal (one loop) is
        multiplied by `envelope` (ticks,), which rises from 0 to 1. None: the loop's command times the envelope is to be
        used."""
        ...


class IdentityEqualizer:
    """No equalizer: the reference force is the commanded force. Implements `Equalizer`."""

    name = "none (commanded force)"
    reference_quantity = "force"

    def compute_loop_commands(self, reference: Signal) -> Signal:
        """Return the reference force itself. Raises ValueError for another quantity than force."""
        if reference.quantity != "force":
            raise ValueError(f"without an equalizer only a force can be played, not {reference.quantity}; give a model")
        return reference

    def compute_onset_commands(self, reference: Signal, envelope: FloatArray) -> None:
        # The command is the reference force times the envelope.
        return None
