"""Write masking noise as a WAV file (`hapteq noise`), to be played during a sitting so that the participant cannot hear
the device: pink noise between two corner frequencies, which can be repeated without a discontinuity."""

from dataclasses import dataclass
from pathlib import Path

from equalizer.signals.masking_noise import make_masking_noise
from study.errors import WrongUseError
from study.store.disk.file_errors import AlreadyExistsError
from study.store.disk.wav_file import write_wav

SAMPLE_RATE_HZ = 44_100
"""Sample rate of the file (Hz): that of audio CDs."""

PLAYBACK_INSTRUCTIONS = (
    "Play it in a loop, without a gap, from before the demonstration until after the last trial: it repeats without "
    "a seam.",
    "Set the level with the device playing its loudest stimulus and your hand off the handle: raise it until you can "
    "no longer hear the device, and no further.",
    "Keep it below 80 dB(A), the lower action value of directive 2003/10/EC for a working day. If the device is heard "
    "through that, add ear protection rather than level.",
)
"""Instructions for the experimenter."""


@dataclass(frozen=True, slots=True)
class NoisePlan:
    """Length, band and seed of masking noise."""

    minutes: float
    """Length in minutes, rounded to whole seconds."""
    low_hz: float
    """Lower corner frequency (Hz)."""
    high_hz: float
    """Upper corner frequency (Hz), at most half of `SAMPLE_RATE_HZ`."""
    seed: int
    """Seed of the random phases."""


def write_masking_noise(path: Path, plan: NoisePlan) -> None:
    """Write the noise as a WAV file: mono, 16 bit, about 5 MB per minute.

    Raises WrongUseError where the suffix is not .wav or length or band give no noise, AlreadyExistsError where the file
    exists, CannotWriteError where it cannot be written.
    """
    if path.suffix.lower() != ".wav":
        raise WrongUseError(
            "That is no name for a sound", f"{path.name} does not end in .wav.", "Give a name such as noise.wav."
        )
    if path.exists():
        raise AlreadyExistsError(path)
    try:
        samples = make_masking_noise(round(60 * plan.minutes), plan.low_hz, plan.high_hz, plan.seed, SAMPLE_RATE_HZ)
    except ValueError as problem:
        raise WrongUseError(
            "Such noise cannot be made", f"{problem}.", "Choose other corners or minutes.", saved="Nothing was written."
        ) from problem
    write_wav(path, samples, SAMPLE_RATE_HZ)
