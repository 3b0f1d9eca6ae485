"""Settings of the identification of a state-space model (`identify`): band, order, bound of the time constants, search.

Defaults without a stated reason are heuristic. Read by `identify`, `identify_recordings` and `order_report` with the
modules that they call; set by the workflows `identify_model` and `report_identification`.
"""

from dataclasses import dataclass

WIDE_OCTAVES = 4.5
"""Width of a band (octaves) above which it is fitted on logarithmic bins, because lines at equal distances in Hz are
mostly at its upper end."""
ORDINARY_DECAY_S = 0.5
"""Upper bound of a pole's time constant (s) unless the data require a longer one. Superfluous poles move to the bound,
where they do not raise the cost; without a bound, superfluous poles with a slow decay would corrupt simulations."""


@dataclass(frozen=True, slots=True)
class IdentificationSettings:
    """Band and order of a model, and settings of the search. Raises ValueError for a band that does not rise from above
    0, an order that is odd or below 2, a longest decay that is not positive and finite, negative or no
    `longer_horizons`, and a negative margin or number of draws."""

    band_hz: tuple[float, float] = (5.0, 35.0)
    """Lower and upper end (Hz) of the band that the model must reproduce."""
    order: int = 26
    """Number of states; even, because poles are fitted in pairs."""
    longest_decay_s: float | None = None
    """Upper bound of the poles' time constants (s). None: ORDINARY_DECAY_S, relaxed for poles whose decay is
    significantly longer (`relaxed_poles`)."""
    longer_horizons: tuple[int, ...] = (0, 2)
    """Numbers of block rows of subspace identification beyond the least possible; each gives a starting model."""
    spare_horizons: tuple[int, ...] = (1, 3, 4, 6)
    """Further block rows for a wide band, tried one after the other while the best fit leaves residuals above the
    noise, because a fit may end in a local optimum."""
    record_horizons: tuple[int, ...] = (16,)
    """Numbers of past and of future samples in canonical variate analysis of time records; each gives a starting
    model."""
    margin: float = 0.1
    """Relative width of the margins beyond the band whose lines are fitted too, where they were measured."""
    draws: int = 30
    """Number of bootstrap draws of the parameters; 0 = none."""
    seed: int = 1
    """Random seed of the draws."""

    def __post_init__(self) -> None:
        low, high = self.band_hz
        if not 0 < low < high:
            raise ValueError(f"band_hz is {low:g} to {high:g}; it must rise from above 0")
        if self.order < 2 or self.order % 2:
            raise ValueError(f"order is {self.order}; it must be even and at least 2, because poles come in pairs")
        if self.longest_decay_s is not None and not 0 < self.longest_decay_s < float("inf"):
            raise ValueError(f"longest_decay_s is {self.longest_decay_s:g}; it must be above 0 and finite")
        if not self.longer_horizons or min(self.longer_horizons) < 0:
            raise ValueError(f"longer_horizons is {self.longer_horizons}; give at least one number, none negative")
        if self.margin < 0 or self.draws < 0:
            raise ValueError(f"margin is {self.margin:g} and draws {self.draws}; neither may be negative")

    @property
    def fitted_hz(self) -> tuple[float, float]:
        """The band and its margins (Hz): the range of the lines that are fitted."""
        low, high = self.band_hz
        return low / (1 + self.margin), high * (1 + self.margin)

    @property
    def decay_s(self) -> float:
        """Bound of the time constants (s) at the beginning of a search."""
        return ORDINARY_DECAY_S if self.longest_decay_s is None else self.longest_decay_s

    @property
    def centre_hz(self) -> float:
        """Geometric mean of the band's ends (Hz)."""
        low, high = self.band_hz
        return float((low * high) ** 0.5)

    @property
    def wide(self) -> bool:
        """Whether the band spans more than `WIDE_OCTAVES`."""
        low, high = self.band_hz
        return bool(high > low * 2.0**WIDE_OCTAVES)
