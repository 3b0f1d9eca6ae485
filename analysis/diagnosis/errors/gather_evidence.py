"""What starting values are drawn from: the motion and the force that a fit leaves unexplained."""

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.output_error import Fitted
from analysis.diagnosis.errors.tuning import Tuning
from equalizer.effects.evidence import Evidence


def gather_evidence(measure: ErrorMeasure, tuning: Tuning, fitted: Fitted) -> tuple[Evidence, ...]:
    """One per record."""
    return measure.evidence(tuning.tuned(fitted.deviations), fitted.hypothesis.placed(), fitted.residuals)
