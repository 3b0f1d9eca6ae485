"""Settings of a simulated case of the blind test: driven axes, recording, nuisance effects, integration steps."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class CaseSettings:
    """Settings of a case; the defaults are chosen. Axes that are not driven move passively, and their parameters are
    known exactly."""

    axes: tuple[int, ...] = (0, 1, 2)
    """Driven and measured axes, 0 to 2."""
    period: int = 2000
    """Period of a multisine (samples); sweeps and slow sines scale with it (`scale_duration`)."""
    periods: int = 4
    """Number of periods of each multisine for the fit."""
    extras: float = 0.0
    """Factor of the effects of `nuisance_effects`, which no label names; 0 = none, 1 = about a tenth of the noise."""

    steps: int = 20
    """Integration steps per sample. At 20, the error of integration equals a sensor gain error of about 0.2 % on one
    axis; `draw_bank` therefore takes more."""
    loud_n: float = 0.0
    """Level (N) of an additional test segment with all axes at once; 0 = none."""

    def scale_duration(self, samples: int) -> int:
        """Scale a duration (samples), stated for a period of 2000 samples, to this period; rounded down."""
        return samples * self.period // 2000


DEFAULT_SETTINGS = CaseSettings()
"""Three axes, four periods of 2000 samples, no nuisance effects."""
