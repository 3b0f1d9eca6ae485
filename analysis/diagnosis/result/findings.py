"""All findings of a diagnosis: the document, and the data of its figures and sentences."""

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
from analysis.diagnosis.unit_wording import error_text
from equalizer.effects.effect import PlacedEffect
from equalizer.effects.starts.evidence import Evidence
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray
from equalizer.signals.summary import Summarised, Summary

if TYPE_CHECKING:
    from analysis.diagnosis.next_experiment.propose_experiment import Proposal


@dataclass(frozen=True, slots=True, eq=False)
class TimeSeries:
    """One recording, measured and predicted; channels are the response's, then the position's; all (n, c), SI."""

    name: str
    sample_rate_hz: float
    channels: tuple[str, ...]
    units: tuple[str, ...]
    measured: FloatArray
    before: FloatArray
    retuned: FloatArray
    after: FloatArray
    tested: tuple[tuple[int, int], ...]
    """Stretches of held-out samples, which nothing was fitted to or chosen by."""


@dataclass(frozen=True, slots=True, eq=False)
class Signature:
    """A curve that shows a named effect: the missing force or the residual against its variable, with the fitted
    law."""

    effect: str
    axis: str | None
    along: str
    """Label of the abscissa with unit: "velocity of x (m/s)"."""
    of: str
    """Label of the ordinate with unit."""
    measured_at: FloatArray
    """(k,)"""
    measured: FloatArray
    """(k,): mean of the missing quantity there."""
    spread: FloatArray
    """(k,): its standard error."""
    law_at: FloatArray
    """(q,)"""
    law: FloatArray
    """(q,)"""
    visited: tuple[float, float] | None = None
    """Range of the abscissa that the recordings visited; the law is drawn beyond it."""


@dataclass(frozen=True, slots=True, eq=False)
class BlackBox:
    """A model without physics and with as many parameters, fitted to the same samples."""

    kind: str
    numbers: int
    test: float
    """Error on the test samples, as in `document.Errors`."""
    physics: float
    """The same of the named effects."""


@dataclass(frozen=True, slots=True)
class BalanceErrors:
    """Errors of one axis's force balance on held-out data, rms over the signal's rms."""

    axis: str
    linear: float
    """With mass, damping and stiffness alone."""
    named: float
    """With the named laws."""
    ceiling: float
    """With all laws together."""
    any_named: bool
    tested: bool = True
    """Whether the held-out samples move enough to test laws by."""
    given: bool = False
    """Whether the model was given: `linear` is then the error of the re-tuned model."""

    @property
    def share(self) -> float:
        """Share of the gain of all laws together that the named laws reach."""
        room = self.linear**2 - self.ceiling**2
        return min(max((self.linear**2 - self.named**2) / room, 0.0), 1.0) if room > 0 else 0.0


@dataclass(frozen=True, repr=False, slots=True, eq=False)
class Findings(Summarised):
    """Findings of a diagnosis: the document (`diagnosis`), the improved model, and the data of figures and page."""

    diagnosis: Diagnosis
    explanation: Explanation
    given: MechanicalModel
    """The initial model; see `fitted`."""
    improved: MechanicalModel
    """The re-tuned model with the named effects among its `effects`; driven by the commands as they were recorded."""
    named: tuple[PlacedEffect, ...]
    evidence: tuple[Evidence, ...]
    """Evidence of the re-tuned model, per recording."""
    time_series: tuple[TimeSeries, ...]
    noise_rms: Mapping[str, float]
    """Noise rms by channel, SI."""
    channel_errors: Mapping[str, Mapping[str, float]]
    """Rms error over the test samples in units of the noise: by stage ("before", "retuned", "after"), then by
    channel."""
    mismatch: tuple[Mismatch, ...]
    """All tested cells, not only the significant ones (see p_value and share)."""
    signatures: tuple[Signature, ...]
    black_box: BlackBox | None
    remarks: tuple[str, ...]
    """Remarks as sentences: assumptions, weaknesses, implausible results."""
    maps: Mapping[str, tuple[MismatchCell, ...]] = field(default_factory=dict)
    """Every cell of the mismatch map, in units of the noise, by stage ("before", "retuned", "after")."""
    local: Localisation = field(default_factory=Localisation)
    """Localisation of the mismatch: in which states, through which input, and of which kind."""
    fitted: bool = False
    """Whether `given` was fitted to these recordings by the program: there is then no calibration of its parameters."""
    floor: NoiseFloor | None = None
    """Noise of the first recording: how it was measured, and its spectrum."""
    is_timed: bool = True
    """Whether the time axis is known: if not, frequencies are in cycles per sample."""
    tuning: Tuning | None = None
    """Free parameters of the model that the deviations of `explanation` belong to: names, units, standard
    deviations."""
    axes: tuple[str, ...] = ()
    """Displayed names of the driven axes; empty = x, y, z."""
    proposal: "Proposal | None" = None
    """The next recording proposed, where rivals are as good as what is named."""
    reached: tuple[BalanceErrors, ...] = ()
    """Force balance per axis; empty where none was computed."""
    state_maps: tuple[StateMaps, ...] = ()
    """Maps per axis, in the order of drawing."""
    split_s: Mapping[str, float] = field(default_factory=dict)
    """Duration in seconds by "fit", "choose", "test"."""
    retuned: MechanicalModel | None = None
    """The re-tuned model without new physics; as `improved`."""
    own_errors: FloatArray | None = None
    """(t,): standard errors of the deviations of the model's own parameters, as `tuning` counts them; NaN = not
    computed."""

    def summary(self) -> Summary:
        errors = self.diagnosis.fit.test
        left = {"as given": errors.before, "re-tuned": errors.retuned, "with the effects": errors.after}
        return Summary(
            f"Diagnosis: {self.diagnosis.verdict.replace('_', ' ')}",
            (
                *(("missing", effect_text(effect)) for effect in self.diagnosis.effects),
                *(("candidate", f"{each.effect} {each.axis or ''}".strip()) for each in self.diagnosis.candidates[:3]),
                *((f"held-out error {stage}", error_text(value)) for stage, value in left.items()),
                ("noise alone", error_text(errors.noise)),
            ),
        )


def effect_text(effect: NamedEffect) -> str:
    """The effect's name and axis, and its parameters with units, in a line, each value to four significant digits."""
    numbers = ", ".join(
        f"{name} {each.value:.4g} {'' if each.unit == '1' else each.unit}".strip()
        for name, each in effect.parameters.items()
    )
    return f"{effect.effect} {effect.axis or ''}: {numbers}"
