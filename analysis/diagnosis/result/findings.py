"""Result types of a diagnosis: the document, and the data of its figures and sentences.

`assemble_findings` builds `Findings` after the search, `wording` puts them in sentences, and
`analysis.figures.diagnosis` draws them. Errors are rms values; each attribute states what they are relative to.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from analysis.diagnosis.document import Diagnosis, Mismatch, NamedEffect
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.localisation.localisation import Localisation
from analysis.diagnosis.localisation.mismatch_cells import MismatchCell
from analysis.diagnosis.noise.noise_floor import NoiseFloor
from analysis.diagnosis.result.curves.state_maps import StateMaps
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.unit_wording import format_error
from equalizer.effects.effect import PlacedEffect
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray
from equalizer.signals.summary import Summary, SummaryDisplay

if TYPE_CHECKING:
    from analysis.diagnosis.next_experiment.propose_experiment import Proposal


@dataclass(frozen=True, slots=True, eq=False)
class TimeSeries:
    """One record (a recording, or a part of one between gaps), measured and predicted, in `units`: n samples of c
    channels, the response's before the position's."""

    name: str
    sample_rate_hz: float
    channels: tuple[str, ...]
    units: tuple[str, ...]
    measured: FloatArray
    """(n, c)"""
    before: FloatArray
    """(n, c): prediction of the model as given."""
    retuned: FloatArray
    """(n, c): prediction of the re-tuned model without new physics."""
    after: FloatArray
    """(n, c): prediction of the model with the named effects."""
    tested: tuple[tuple[int, int], ...]
    """First and end sample (exclusive) of each held-out stretch, used neither to fit nor to choose."""


@dataclass(frozen=True, slots=True, eq=False)
class Signature:
    """A curve that shows a named effect: the missing force, or the residual, against the variable on which the effect
    depends, with the fitted law."""

    effect: str
    axis: str | None
    """Letter of the axis; name of the channel where the curve shows the error of a channel; None = all axes."""
    abscissa_label: str
    """Label of the abscissa with unit, such as "velocity of x (m/s)"."""
    ordinate_label: str
    """Label of the ordinate with unit."""
    measured_abscissa: FloatArray
    """(k,): abscissa of the measured points."""
    measured: FloatArray
    """(k,): at these points, the mean of the missing force or of the residual, its running rms, or its amplitude
    density."""
    standard_error: FloatArray
    """(k,): standard error of that value."""
    law_abscissa: FloatArray
    """(q,): abscissa of the law's points."""
    law: FloatArray
    """(q,): value of the fitted law at these points."""
    visited_range: tuple[float, float] | None = None
    """Range of the abscissa that was recorded, beyond which the law is extrapolated; None = no extrapolation."""


@dataclass(frozen=True, slots=True, eq=False)
class BlackBox:
    """A model without physics, with as many terms per channel as the named effects have parameters (at least 1), fitted
    to the same samples (`fit_black_box`)."""

    kind: str
    """What it is, in words."""
    coefficient_count: int
    """Number of its coefficients, all channels together."""
    test_error: float
    """Error on the test samples, relative to the signal, as in `document.Errors`."""
    physics_error: float
    """Error of the model with the named effects (without any, re-tuned) on the same samples, relative to the signal."""


@dataclass(frozen=True, slots=True)
class BalanceErrors:
    """Errors of one axis's force balance on held-out data: rms residual relative to the force's rms."""

    axis: str
    """Letter of the axis."""
    linear_error: float
    """With mass, damping and stiffness alone."""
    named_error: float
    """With the named laws in addition."""
    all_laws_error: float
    """With all candidate laws together: a bound that a few laws can hardly reach."""
    has_named_law: bool
    """Whether a law is named on this axis."""
    tested: bool = True
    """Whether the held-out samples contain enough motion to test laws."""
    is_model_given: bool = False
    """Whether the model was given: `linear_error` is then the error of the re-tuned model."""

    @property
    def share(self) -> float:
        """Reduction of the error power by the named laws over the reduction by all laws together, 0 to 1; 0 where all
        laws together reduce nothing."""
        possible_reduction = self.linear_error**2 - self.all_laws_error**2
        return (
            min(max((self.linear_error**2 - self.named_error**2) / possible_reduction, 0.0), 1.0)
            if possible_reduction > 0
            else 0.0
        )


@dataclass(frozen=True, repr=False, slots=True, eq=False)
class Findings(SummaryDisplay):
    """Findings of a diagnosis: the document (`diagnosis`), the improved model, and the data of figures and page."""

    diagnosis: Diagnosis
    """The document."""
    explanation: Explanation
    """Fits and candidates of the search."""
    given: MechanicalModel
    """The initial model; see `fitted`."""
    improved: MechanicalModel
    """The re-tuned model (after `add_contrast` the given one) with the named effects among its `effects`."""
    named: tuple[PlacedEffect, ...]
    """The named effects with axes and fitted parameters."""
    evidence: tuple[Evidence, ...]
    """Motion, commands and residuals of the re-tuned model, per record."""
    time_series: tuple[TimeSeries, ...]
    """Measured and predicted signals, per record."""
    noise_rms: Mapping[str, float]
    """Noise rms by channel, in the channel's unit."""
    channel_errors: Mapping[str, Mapping[str, float]]
    """Rms error on the test samples, in units of the noise (of the chance variation where band powers are compared): by
    stage ("before", "retuned", "after"), then by channel."""
    mismatch: tuple[Mismatch, ...]
    """All tested cells of the model as given, not only the significant ones (see p_value and share)."""
    signatures: tuple[Signature, ...]
    """Curves that show the named effects."""
    black_box: BlackBox | None
    """Model without physics, for comparison; None where it was not fitted."""
    remarks: tuple[str, ...]
    """Remarks as sentences: assumptions, weaknesses, implausible results."""
    maps: Mapping[str, tuple[MismatchCell, ...]] = field(default_factory=dict)
    """Every cell of the mismatch map, by stage ("before", "retuned", "after")."""
    localisation: Localisation = field(default_factory=Localisation)
    """Localisation of the mismatch: the states it occurs in, where it enters, and the kind of distortion."""
    fitted: bool = False
    """Whether the program fitted `given` to these recordings, so that its parameters have no calibration."""
    floor: NoiseFloor | None = None
    """Noise of the first record: how it was measured, and its spectrum."""
    is_timed: bool = True
    """Whether the time axis is known: if not, frequencies are in cycles per sample."""
    tuning: Tuning | None = None
    """Free parameters of the model that the deviations of `explanation` belong to: names, units, standard
    deviations."""
    axes: tuple[str, ...] = ()
    """Displayed names of the driven axes; empty = x, y, z."""
    reading_units: Mapping[str | None, str] = field(default_factory=dict)
    """Units of the response, by the channel's name in candidates; None: of all channels, where they have the same."""
    proposal: "Proposal | None" = None
    """Proposed next recording, where rivals fit as well as the named effects; None = no proposal."""
    balance_errors: tuple[BalanceErrors, ...] = ()
    """Force balance per axis; empty where none was computed."""
    state_maps: tuple[StateMaps, ...] = ()
    """The missing force over the states of motion, per axis, in the order of drawing."""
    split_s: Mapping[str, float] = field(default_factory=dict)
    """Duration in s of the samples to fit, to choose by and to test; keys "fit", "choose", "test"."""
    retuned: MechanicalModel | None = None
    """The re-tuned model without new physics."""
    own_errors: FloatArray | None = None
    """(t,): standard errors of the model's own parameters, in `tuning.units`; NaN = not computed."""

    def summary(self) -> Summary:
        """Verdict, missing effects, the first three candidates, and the held-out errors with that of noise alone."""
        errors = self.diagnosis.fit.test
        held_out_errors = {"as given": errors.before, "re-tuned": errors.retuned, "with the effects": errors.after}
        return Summary(
            f"Diagnosis: {self.diagnosis.verdict.replace('_', ' ')}",
            (
                *(("missing", format_effect(effect)) for effect in self.diagnosis.effects),
                *(
                    ("candidate", f"{candidate.effect} {candidate.axis or ''}".strip())
                    for candidate in self.diagnosis.candidates[:3]
                ),
                *((f"held-out error {stage}", format_error(value)) for stage, value in held_out_errors.items()),
                ("noise alone", format_error(errors.noise)),
            ),
        )


def format_effect(effect: NamedEffect) -> str:
    """Format name and axis of the effect with its parameters and their units, on one line; values to four significant
    digits."""
    parameter_texts = ", ".join(
        f"{name} {estimate.value:.4g} {'' if estimate.unit == '1' else estimate.unit}".strip()
        for name, estimate in effect.parameters.items()
    )
    return f"{effect.effect} {effect.axis or ''}: {parameter_texts}"
