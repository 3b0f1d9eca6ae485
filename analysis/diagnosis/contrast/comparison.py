"""What a comparison with reference recordings found, fault by fault."""

from dataclasses import dataclass

from analysis.diagnosis.contrast.fault import Fault
from analysis.diagnosis.settings import SETS_APART, SETS_AS_ONE
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class JudgedFault:
    """A fault with its values, its gain, and what it gains between stretches of one set."""

    fault: Fault
    values: dict[str, float]
    spread: dict[str, float]
    """Standard error of each value, from leaving out sixths of either set: what varies among the clean stretches makes
    a number as uncertain as what varies among the others."""
    errors: FloatArray
    """(blocks,): sums of squares with it undone, of the faulty set, then of the clean one."""
    gain: float
    """Error with the fault over the error with it undone, less 1."""
    usual: float
    """The largest gain between stretches of one set, less the typical one."""
    typical: float
    """The median gain between stretches of one set: what it gains by its flexibility alone."""
    share: float
    """Share of the excess error that it explains: that of both sets together over that of a base of each set's own."""
    held_out: float
    """Cross-validated sum of squares of the faulty set."""
    gain_low: float
    """Lower confidence bound of the gain beyond the typical one, by bootstrap over blocks."""
    apart: float
    """The largest excess between stretches of one set, in the faulty one with the fault undone; see `Comparison`."""


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    faults: tuple[JudgedFault, ...]
    """The best first."""
    plain: FloatArray
    """(blocks,): sums of squares with nothing undone, as `JudgedFault.errors`."""
    samples: int
    """Number of samples: the sum of squares where each set has a base of its own, for errors are white with rms 1."""
    faulty_samples: int
    """The same of the faulty set."""
    held_out: float
    """Cross-validated sum of squares of the faulty set, with nothing undone."""
    faulty_share: float
    """Rms error of the faulty set by a base of its own, over the rms of what is predicted."""
    usual: float
    """The largest `excess` between stretches of one set."""
    usual_clean: float
    """The same of the clean set alone."""
    by_force: bool
    step_s: float
    complete: bool
    """All faults were tested before the time ran out."""

    @property
    def excess(self) -> float:
        return float(self.plain.sum()) / self.samples - 1

    @property
    def differ(self) -> bool:
        """Whether the two sets differ by more than stretches of one set do."""
        return self.excess > max(SETS_AS_ONE, SETS_APART * self.usual)

    def differ_but_for(self, fault: JudgedFault) -> bool:
        """The same with the fault undone in the faulty set: one that comes and goes sets its stretches apart, too. And
        one that no base takes up makes all of that set's errors larger, so that it shows in its sure gain alone."""
        return max(self.excess, fault.gain_low) > max(SETS_AS_ONE, SETS_APART * max(self.usual_clean, fault.apart))
