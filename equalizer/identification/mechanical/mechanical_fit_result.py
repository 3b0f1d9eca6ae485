"""Settings and result of a mechanical fit: the model, its errors, and the structures that were tried."""

from dataclasses import dataclass, field

from equalizer.plant.mechanical_model import ActuatorLimits, MechanicalModel, SensorLimits


class MechanicalFitRefused(ValueError):  # noqa: N818 - an answer that a user reads, as in the rest of the package
    """The recordings do not carry a mechanical model; the text says why, and what would do."""


@dataclass(frozen=True, slots=True)
class MechanicalFitSettings:
    band_hz: tuple[float, float] | None = None
    """None: what the commands drive, from the lowest line on."""
    most_modes: int = 8
    """Beside the driven axes."""
    sensor: SensorLimits = field(default_factory=SensorLimits)
    """As its data sheet has it: it is taken as known, not fitted."""
    actuator: ActuatorLimits = field(default_factory=ActuatorLimits)
    """Known beforehand; the delay is where its fit starts, if it is fitted."""
    sensors_elsewhere: bool | None = None
    """Whether response i may move otherwise than what command i pushes (a cable or a joint lies between). None: where
    the left-out lines say so."""
    joint: bool = False
    """Whether what sensors and oscillators sit on hangs on the driven axes by an elastic joint, such as cables. Taken
    where it is known of the device; `sensors_elsewhere` is not asked then."""
    fit_delay: bool = True
    """Whether a delay may be added where the left-out lines ask for it."""
    floor: float = 0.02
    """Of a line's size: what a linear model of a real device is not expected to explain. It keeps a few strong lines
    from deciding everything."""

    def __post_init__(self) -> None:
        if self.band_hz is not None and not 0 <= self.band_hz[0] < self.band_hz[1]:
            raise ValueError(f"band_hz is {self.band_hz}; it must rise, from zero or more")
        if self.most_modes < 0:
            raise ValueError(f"most_modes is {self.most_modes}; it must not be negative")
        if not 0 < self.floor < 1:
            raise ValueError(f"floor is {self.floor:g}; it must lie between 0 and 1")


@dataclass(frozen=True, slots=True)
class OrderTried:
    what: str
    """"driven axes alone", "with 2 modes", "with a delay"..."""
    coordinates: int
    parameters: int
    error: float
    """Weighted root-mean-square on the lines that were left out of the fit: 1 is noise and `floor` together."""
    accepted: bool


@dataclass(frozen=True, slots=True)
class ChannelError:
    """Root-mean-squares over that of the response, within the fitted band."""

    channel: str
    fit: float
    held_out: float | None
    """Free simulation of what was kept for a test, started from the state that fits best; None without such."""
    noise: float | None
    """From period to period; None where nothing repeats."""


@dataclass(frozen=True, slots=True, eq=False)
class MechanicalFit:
    model: MechanicalModel
    """Its first coordinates are the motions of the driven axes, in the commands' order."""
    errors: tuple[ChannelError, ...]
    """One per response channel."""
    error: float
    """Over all channels, on the fitted segments."""
    held_out: float | None
    noise: float | None
    band_hz: tuple[float, float]
    tried: tuple[OrderTried, ...]
    reason: str
    """Why these coordinates and no more, in a sentence."""
    remarks: tuple[str, ...]
    """Sentences: what was assumed, what could not be told."""
