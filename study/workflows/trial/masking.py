"""Masking noise during a sitting, so that the participant cannot hear the device.

The noise starts before the first trial, is silent in pauses, and is logged. A trial counts only with noise: it is
checked before every trial and at every answer. The sound is a loop of pink noise (`make_masking_noise`) from a seed, so
that another session can use the same sound.
"""

import contextlib
from collections.abc import Iterator

import numpy as np

from equalizer.signals.masking_noise import make_masking_noise
from protocols.definition.preparation import MaskingSettings
from study.devices.clock import Clock
from study.devices.opening import make_masking_sound
from study.errors import DeviceError
from study.session.facts.events import MaskingPlayed
from study.session.state.state import SessionState
from study.workflows.trial.sitting import Sitting, SoundOutput, log_and_apply

SAMPLE_RATE_HZ = 44_100
"""Sample rate of the noise (Hz), a standard rate of sound cards."""
LOOP_S = 60
"""Length of the loop (s): too long for a listener to recognise the repetition."""


@contextlib.contextmanager
def open_masking_sound(settings: MaskingSettings, clock: Clock, observer: str | None) -> Iterator[SoundOutput | None]:
    """Sound output with the masking noise, not yet playing, closed at the end of the context. None where the protocol
    plays none, or without a person (a simulated participant, virtual time). Raises `DeviceError` without an output."""
    if not settings.play or clock.virtual or observer is not None:
        yield None
        return
    samples = make_masking_noise(LOOP_S, settings.low_hz, settings.high_hz, settings.seed, SAMPLE_RATE_HZ)
    attenuated = np.rint(samples * 10 ** (settings.level_db / 20)).astype(np.int16)
    with contextlib.closing(make_masking_sound(attenuated, SAMPLE_RATE_HZ)) as sound:
        yield sound


def start_masking(state: SessionState, sitting: Sitting) -> SessionState:
    """Start the masking noise and log that it plays. Raises `DeviceError`. No effect without a sound output."""
    if sitting.masking_noise is None:
        return state
    sitting.masking_noise.start()
    return _log(state, sitting, sitting.masking_noise, playing=True)


def check_masking(state: SessionState, sitting: Sitting) -> SessionState:
    """Check before a trial that the noise is playing. Raises `DeviceError` if it is not, after logging the failure."""
    if sitting.masking_noise is None:
        return state
    try:
        sitting.masking_noise.check()
    except DeviceError as error:
        _log(state, sitting, sitting.masking_noise, playing=False, trouble=error.happened)
        raise
    return state


def was_masked(sitting: Sitting) -> bool:
    """Whether the noise was still playing at the answer; True where none is required. A failure is logged before the
    next trial (`check_masking`)."""
    if sitting.masking_noise is None:
        return True
    try:
        sitting.masking_noise.check()
    except DeviceError:
        return False
    return True


def stop_masking(state: SessionState, sitting: Sitting) -> SessionState:
    """Stop the masking noise and log it. The state is unchanged if there was nothing to stop."""
    if sitting.masking_noise is None or not sitting.masking_noise.stop():
        return state
    return _log(state, sitting, sitting.masking_noise, playing=False)


def _log(state: SessionState, sitting: Sitting, sound: SoundOutput, playing: bool, trouble: str = "") -> SessionState:
    """Log whether the noise plays, with its settings. trouble: why it does not; empty if it was stopped as planned."""
    settings = state.protocol.masking
    fact = MaskingPlayed(
        utc=sitting.clock.utc(),
        playing=playing,
        output=sound.output,
        level_db=settings.level_db,
        low_hz=settings.low_hz,
        high_hz=settings.high_hz,
        seed=settings.seed,
        trouble=trouble,
    )
    return log_and_apply(state, fact, sitting)
