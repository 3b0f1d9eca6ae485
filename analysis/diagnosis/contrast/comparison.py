"""Result of a comparison with reference recordings, fault by fault: gains, excess errors, and whether the sets differ.

With E the sum of squared whitened errors of one base fitted to both sets, and E0 that of separate bases, the excess is
E / E0 - 1. It is compared with the excess between stretches of one set, in which nothing should differ.
"""

from dataclasses import dataclass

from analysis.diagnosis.contrast.fault import Fault
from analysis.diagnosis.settings import SETS_APART, SETS_AS_ONE
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class JudgedFault:
    """A fault with its values, its gain, and its gains between stretches of one set."""

    fault: Fault
    values: dict[str, float]
    """Fitted parameters of the effect by name, in SI units."""
    spread: dict[str, float]
    """Standard error of each value, by leaving out sixths of either set: variation within the clean set counts as well
    as that within the faulty set."""
    errors: FloatArray
    """(blocks,): sums of squares with the fault undone, of the faulty set, then of the clean one."""
    gain: float
    """Error with the fault over the error with it undone, less 1."""
    control_gain: float
    """The largest gain between stretches of one set, less their median: the gain due to the flexibility of the fault
    alone."""
    share: float
    """Share of the excess error that the fault explains; excess: see `Comparison.excess`."""
    held_out_squares: float
    """Cross-validated sum of squares of the faulty set."""
    gain_low: float
    """Lower confidence bound of the gain less the median gain between stretches of a set, by bootstrap over blocks."""
    control_excess: float
    """The largest excess between stretches of one set, in the faulty one with the fault undone; see `Comparison`."""


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """All tested faults with their gains, the errors with nothing undone, and those between stretches of one set."""

    faults: tuple[JudgedFault, ...]
    """The best first."""
    errors: FloatArray
    """(blocks,): sums of squares with nothing undone, as `JudgedFault.errors`."""
    samples: int
    """Number of samples: the sum of squares with separate bases, because errors are scaled to white noise with rms
    1."""
    faulty_samples: int
    """Number of samples of the faulty set."""
    held_out_squares: float
    """Cross-validated sum of squares of the faulty set, with nothing undone."""
    faulty_share: float
    """Rms error of the faulty set with its own base, relative to the predicted quantity."""
    control_excess: float
    """The largest `excess` between stretches of one set."""
    clean_control_excess: float
    """The largest `excess` between stretches of the clean set."""
    by_force: bool
    """Whether the bases of the device are force balances; else they are autoregressions."""
    step_s: float
    """Time from one row to the next, in s."""
    complete: bool
    """Whether all faults were tested before the time ran out."""

    @property
    def excess(self) -> float:
        """Sum of squares of one base for both sets over that of separate bases, less 1; 0 = no difference."""
        return float(self.errors.sum()) / self.samples - 1

    @property
    def differ(self) -> bool:
        """Whether the two sets differ by more than stretches of one set do."""
        return self.excess > max(SETS_AS_ONE, SETS_APART * self.control_excess)

    def differ_but_for(self, fault: JudgedFault) -> bool:
        """Whether the two sets differ by more than stretches of one set, with the fault undone between those of the
        faulty set, because an intermittent fault makes these differ too. A fault that no base absorbs raises all errors
        of the faulty set, and shows only in the lower bound of its gain; so the larger of both is compared."""
        return max(self.excess, fault.gain_low) > max(
            SETS_AS_ONE, SETS_APART * max(self.clean_control_excess, fault.control_excess)
        )
