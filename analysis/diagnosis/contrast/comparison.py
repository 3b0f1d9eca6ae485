"""Result of comparing recordings of a faulty and of the intact device: excess error, and gain of each possible fault.

A base is a linear model of the device (`bases`) that predicts a signal from others. With E the sum of squared whitened
errors of one base fitted to both sets, and E0 that of a separate base for each set, the excess is E / E0 - 1. It is
compared with the excess between stretches of a single set (negative control), where the device is the same. Undoing a
fault means to transform the recorded signals to those without it (`fault`). Made by `rank_faults`.
"""

from dataclasses import dataclass

from analysis.diagnosis.contrast.fault import Fault
from analysis.diagnosis.limits import SAME_DEVICE_EXCESS, SETS_EXCESS_FACTOR
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class JudgedFault:
    """A fault with its fitted parameters, its gain, and its gain in the negative control (between stretches of one
    set)."""

    fault: Fault
    values: dict[str, float]
    """Fitted parameters of the effect by name, in SI units."""
    standard_errors: dict[str, float]
    """Standard error of each parameter, by a jackknife that leaves out a sixth of either set; it includes the spacing
    of the tried variants."""
    block_squares: FloatArray
    """(blocks,): sums of squared errors over all bases, each fitted to both sets with the fault undone, blocks of the
    faulty set, then of the clean one; times 1 + the median gain in the negative control, if that is positive."""
    gain: float
    """Sum of `Comparison.block_squares` (no fault undone) over the sum of `block_squares`, minus 1; above 0 = undoing
    it helps."""
    control_gain: float
    """The largest gain (at least 0) in the negative control minus the median: the gain that the free parameters of the
    fault yield where there is no fault; 0 without a control, for a fault with a negligible gain."""
    share: float
    """Share of the excess error (`Comparison.excess`) that is removed with the fault undone; 0 without an excess."""
    held_out_squares: float
    """Cross-validated sum of squared errors of the faulty set, with the fault undone."""
    gain_low: float
    """Lower confidence bound of `gain`, by bootstrap over blocks."""
    control_excess: float
    """The largest excess between stretches of the faulty set, with the fault undone."""


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """The tested faults, the errors with no fault undone, and the excess errors of the negative control."""

    faults: tuple[JudgedFault, ...]
    """The best fault first."""
    block_squares: FloatArray
    """(blocks,): sums of squared errors as `JudgedFault.block_squares`, with no fault undone."""
    sample_count: int
    """Number of samples of both sets, summed over the bases. It is also E0, because the errors of separate bases are
    scaled to white noise with rms 1."""
    faulty_sample_count: int
    """Number of samples of the faulty set, summed over the bases."""
    held_out_squares: float
    """Cross-validated sum of squared errors of the faulty set, with no fault undone."""
    faulty_share: float
    """Standard deviation of the error of the first base, fitted to the faulty set alone, over that of its signal; at
    most 1."""
    control_excess: float
    """The largest `excess` between stretches of one set."""
    clean_control_excess: float
    """The largest `excess` between stretches of the clean set."""
    by_force: bool
    """Whether the bases of the device are force balances; else they are autoregressions."""
    step_s: float
    """Time (s) between consecutive samples of the bases."""
    complete: bool
    """Whether all faults were tested before the time limit."""

    @property
    def excess(self) -> float:
        """E / E0 - 1: sum of squared errors of one base for both sets over that of separate bases, less 1; 0 = the sets
        do not differ."""
        return float(self.block_squares.sum()) / self.sample_count - 1

    @property
    def has_difference(self) -> bool:
        """Whether the two sets differ by more than stretches of one set do."""
        return self.excess > max(SAME_DEVICE_EXCESS, SETS_EXCESS_FACTOR * self.control_excess)

    def has_difference_without(self, fault: JudgedFault) -> bool:
        """Whether the two sets differ by more than stretches of one set do, where the stretches of the faulty set are
        compared with the fault undone: an intermittent fault makes them differ, too. The difference of the sets is the
        larger of `excess` and the lower bound of the gain of the fault: a fault that a separate base cannot fit raises
        all errors of the faulty set, and so does not raise `excess`."""
        return max(self.excess, fault.gain_low) > max(
            SAME_DEVICE_EXCESS, SETS_EXCESS_FACTOR * max(self.clean_control_excess, fault.control_excess)
        )
