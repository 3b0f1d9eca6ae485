"""Masking noise during a sitting, so that the participant cannot hear the device.

The noise is checked before a trial and at its answer; a trial during which it stopped is void. The sound is a loop of
pink noise (`make_masking_noise`) from the protocol's seed, so that other sessions use the same sound.
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
"""Length of the loop (s). Chosen so long that a listener does not recognise the repetition."""


@contextlib.contextmanager
def open_masking_sound(settings: MaskingSettings, clock: Clock, observer: str | None) -> Iterator[SoundOutput | None]:
    """Open the sound output with the masking noise, at the gain `settings.level_db` (dB, at most 0) and not yet
    playing; it is closed at the end of the context. Yields None where the protocol plays no noise, for a simulated
    participant (`observer` is its name) and in virtual time. Raises DeviceError where there is no sound output."""
    if not settings.play or clock.virtual or observer is not None:
        yield None
        return
    noise_samples = make_masking_noise(LOOP_S, settings.low_hz, settings.high_hz, settings.seed, SAMPLE_RATE_HZ)
    attenuated_samples = np.rint(noise_samples * 10 ** (settings.level_db / 20)).astype(np.int16)
    with contextlib.closing(make_masking_sound(attenuated_samples, SAMPLE_RATE_HZ)) as sound:
        yield sound


def start_masking(state: SessionState, sitting: Sitting) -> SessionState:
    """Start the masking noise, log it, and return the new state. Without a sound output the state is unchanged. Raises
    DeviceError where the noise cannot be played; nothing is logged then."""
    if sitting.masking_noise is None:
        return state
    sitting.masking_noise.start()
    return _log_masking(state, sitting, sitting.masking_noise, playing=True)


def check_masking(state: SessionState, sitting: Sitting) -> SessionState:
    """Check that the noise is playing; the returned state is unchanged. Raises DeviceError where it is not, after
    logging the failure. Without a sound output nothing is checked."""
    if sitting.masking_noise is None:
        return state
    try:
        sitting.masking_noise.check()
    except DeviceError as error:
        _log_masking(state, sitting, sitting.masking_noise, playing=False, trouble=error.happened)
        raise
    return state


def is_masked(sitting: Sitting) -> bool:
    """Whether the noise is still playing, checked at the answer; True without a sound output. A failure is not logged
    here, but by `check_masking` before the next trial."""
    if sitting.masking_noise is None:
        return True
    try:
        sitting.masking_noise.check()
    except DeviceError:
        return False
    return True


def stop_masking(state: SessionState, sitting: Sitting) -> SessionState:
    """Stop the masking noise, log it, and return the new state; the state is unchanged where no noise was playing."""
    if sitting.masking_noise is None or not sitting.masking_noise.stop():
        return state
    return _log_masking(state, sitting, sitting.masking_noise, playing=False)


def _log_masking(
    state: SessionState, sitting: Sitting, sound_output: SoundOutput, playing: bool, trouble: str = ""
) -> SessionState:
    """Log whether the noise plays, with its settings, and return the new state. trouble: why it does not play; empty
    where it plays or was stopped as planned."""
    settings = state.protocol.masking
    event = MaskingPlayed(
        utc=sitting.clock.utc(),
        playing=playing,
        output=sound_output.output,
        level_db=settings.level_db,
        low_hz=settings.low_hz,
        high_hz=settings.high_hz,
        seed=settings.seed,
        trouble=trouble,
    )
    return log_and_apply(state, event, sitting)
