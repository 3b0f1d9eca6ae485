"""Data classes of the fit of a mechanical model (`mechanical_fit`): settings, errors, compared structures, result."""

from collections.abc import Callable
from dataclasses import dataclass, field

from equalizer.plant.mechanical_model import ActuatorLimits, MechanicalModel, SensorLimits
from equalizer.signals.summary import Summary, SummaryDisplay, format_range


class MechanicalFitError(ValueError):
    """No mechanical model can be fitted to the recordings. The message states the cause and, if there is one, the
    remedy."""


@dataclass(frozen=True, slots=True)
class MechanicalFitSettings:
    """Settings of a mechanical fit. Raises ValueError for a band that does not rise from zero or more, a negative
    number of modes, or a floor outside 0 to 1."""

    band_hz: tuple[float, float] | None = None
    """Band of the fit in Hz; None: the band that the commands excite."""
    most_modes: int = 8
    """Largest number of modes in addition to the driven axes."""
    sensor: SensorLimits = field(default_factory=SensorLimits)
    """Bandwidth and range of the sensor from its data sheet: assumed, not fitted."""
    actuator: ActuatorLimits = field(default_factory=ActuatorLimits)
    """Known limits of the actuator; its delay is the starting value where a delay is fitted."""
    noncollocated_sensors: bool | None = None
    """Whether sensor i may be non-collocated with actuator i (a cable or joint lies between). None: decided by
    cross-validation."""
    joint: bool = False
    """Whether sensors and oscillators are connected to the driven axes by an elastic joint, such as cables. Set it only
    where that is known of the device; `noncollocated_sensors` is then ignored."""
    fit_delay: bool = True
    """Whether a delay is added where it lowers the cross-validated error."""
    grounded: bool = True
    """Whether springs to the ground may be fitted: not where all shafts turn freely."""
    floor: float = 0.02
    """Expected error of a linear model of a real device, as a share of a line's magnitude; it limits the weight of
    strong lines in the fit. Chosen."""
    time_left: Callable[[], bool] = lambda: True
    """Time limit: where it returns False, no further structure is fitted, and the best so far is the result."""

    def __post_init__(self) -> None:
        if self.band_hz is not None and not 0 <= self.band_hz[0] < self.band_hz[1]:
            raise ValueError(f"band_hz is {self.band_hz}; it must rise, from zero or more")
        if self.most_modes < 0:
            raise ValueError(f"most_modes is {self.most_modes}; it must not be negative")
        if not 0 < self.floor < 1:
            raise ValueError(f"floor is {self.floor:g}; it must lie between 0 and 1")


@dataclass(frozen=True, slots=True)
class OrderCandidate:
    """A model structure that the order selection fitted, with its cross-validated error."""

    description: str
    """Description of the structure: "driven axes alone", "with 2 modes", "with a delay"..."""
    coordinates: int
    """Number of generalized coordinates; of modes where the shapes are free."""
    parameters: int
    """Number of fitted parameters."""
    error: float
    """Weighted root-mean-square error on lines left out of the fit (cross-validation). 1: as large as expected from
    noise and `floor` together."""
    accepted: bool
    """Whether the order selection adopted this structure."""


@dataclass(frozen=True, slots=True)
class ChannelError:
    """Root-mean-square errors relative to the response, within the fitted band."""

    channel: str
    fit: float
    """Error of a free simulation of the fitted segments from the best-fitting initial state."""
    held_out: float | None
    """Error of a free simulation of the held-out samples from the best-fitting initial state; None without such
    samples."""
    noise: float | None
    """Noise as estimated for each segment; None where it is not known."""


@dataclass(frozen=True, repr=False, slots=True, eq=False)
class MechanicalFit(SummaryDisplay):
    """Result of a mechanical fit. `error`, `held_out` and `noise` are root mean square over all channels, relative to
    the response, within the fitted band."""

    model: MechanicalModel
    """The fitted model. Its first coordinates are the motions of the driven axes, in the commands' order."""
    errors: tuple[ChannelError, ...]
    """One per response channel."""
    error: float
    """Error over all channels, on the fitted segments."""
    held_out: float | None
    """Error over all channels on the held-out segments, as `ChannelError.held_out`."""
    noise: float | None
    """Noise over all channels, as `ChannelError.noise`."""
    band_hz: tuple[float, float]
    """Lowest and highest fitted frequency (Hz)."""
    candidates: tuple[OrderCandidate, ...]
    """All structures that the order selection fitted, in this order."""
    reason: str
    """Reason for the number of coordinates, as a sentence."""
    remarks: tuple[str, ...]
    """Sentences: assumptions, and what the recordings do not determine."""

    def summary(self) -> Summary:
        """Rows of the model, fitted band, errors and remarks, for display."""
        errors = {"error": self.error, "held-out error": self.held_out, "noise": self.noise}
        return Summary(
            "Fitted mechanical model",
            (
                *self.model.summary().rows,
                ("band", format_range(*self.band_hz, "Hz")),
                *((name, f"{100 * value:.3g} %") for name, value in errors.items() if value is not None),
                *(("remark", remark) for remark in self.remarks),
            ),
        )
