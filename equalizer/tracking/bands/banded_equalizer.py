"""Equalizer for arbitrary accelerations in three bands: rigid model, identified model, one degree of freedom above.

Where one model covers the whole band of the wanted acceleration, both edges can be left out: the equalizer is then
wide-band.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.fft import next_fast_len

from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import FloatArray
from equalizer.tracking.bands.banded_forces import BandedForces
from equalizer.tracking.bands.high_band import (
    HighBandForces,
    HighBandSettings,
    ResponseSource,
    high_band_forces,
    predict_acceleration,
    project_to_one_dof,
    reduce_to_one_dof,
)
from equalizer.tracking.bands.low_band import CORNER_HZ, SlowMotion, low_band_forces, plan_motion, plan_motion_causally
from equalizer.tracking.bands.rigid_model import RigidModel
from equalizer.tracking.bands.stylus import StylusActuator, StylusShare, share_with_stylus
from equalizer.tracking.feedforward.band_split import CausalSplit, LinearPhaseSplit
from equalizer.tracking.feedforward.virtual_spring import NO_SPRING, VirtualSpring
from equalizer.tracking.lqr.constrained import track_under_cap
from equalizer.tracking.lqr.limits import require_under_cap
from equalizer.tracking.lqr.lqr import stored_gains, track
from equalizer.tracking.lqr.tracking_problem import TrackingWeights, make_tracking_problem

PADDING_S = 0.3
"""Zeros added before and after: the device does not answer a constant force with acceleration, so that its inverse
starts early and ends late (non-causal)."""
LOW_BAND_DECAYS = 6.0
"""Time constants of the low band's slow return to rest that are played too: cut off sooner, it ends with a jolt."""
SMALLEST_WEIGHT, LARGEST_WEIGHT = 1e-3, 1e-2
"""Range of the force weight. Below, forces drift where no model was identified; above, the level falls short."""


@dataclass(frozen=True, slots=True, eq=False)
class LowBand:
    """Low band: the rigid model whose inverse dynamics give its forces, and the high-pass corner of its motion (Hz)."""

    rigid: RigidModel
    corner_hz: float = CORNER_HZ


@dataclass(frozen=True, slots=True, eq=False)
class HighBand:
    """High band, played with one degree of freedom; a stylus actuator, where there is any, takes its upper part."""

    source: ResponseSource
    """Response of the device over the whole high band."""
    settings: HighBandSettings = field(default_factory=HighBandSettings)
    stylus: StylusActuator | None = None


@dataclass(frozen=True, slots=True)
class CapPolicy:
    """Cap on the norm of the force vector that enters the device, all bands added, and what is done above it."""

    cap_n: float
    constrain: bool = False
    """False: forces above the cap are refused. True: the middle band is solved again under the cap left by the other
    bands."""


@dataclass(frozen=True, slots=True, eq=False)
class BandedEqualizer:
    """The equalizer. Raises ValueError where an edge has no model beyond it, or the weight is outside 1e-3 to 1e-2."""

    middle: IdentifiedModel
    split: LinearPhaseSplit | CausalSplit
    """A causal split makes all of the playback causal: it begins with the first row, as at a contact."""
    low: LowBand | None = None
    high: HighBand | None = None
    weights: TrackingWeights = field(default_factory=TrackingWeights)
    spring: VirtualSpring = NO_SPRING

    def __post_init__(self) -> None:
        for name, edge, band in (
            ("low", self.split.edges.low_hz, self.low),
            ("high", self.split.edges.high_hz, self.high),
        ):
            if edge is not None and band is None:
                raise ValueError(f"the split has a {name} band beyond {edge:g} Hz, but there is no model to play it")
            if edge is None and band is not None:
                raise ValueError(f"there is a model for a {name} band, but the split has none")
        if not SMALLEST_WEIGHT <= self.weights.weight <= LARGEST_WEIGHT:
            raise ValueError(
                f"weight is {self.weights.weight}; it must be within {SMALLEST_WEIGHT:g} and {LARGEST_WEIGHT:g}"
            )
        if self.split.sample_rate_hz != self.middle.sample_rate_hz:
            raise ValueError(
                f"the split is at {self.split.sample_rate_hz:g} Hz, the model at {self.middle.sample_rate_hz:g} Hz"
            )

    @property
    def causal(self) -> bool:
        """Whether the split is causal: forces then begin with the first wanted row."""
        return isinstance(self.split, CausalSplit)

    @property
    def latency_samples(self) -> int:
        """Rows of the forces before the one that belongs to the first wanted row: filter delay, and padding unless
        causal."""
        return self.split.latency_samples + (0 if self.causal else self._padding)

    @property
    def latency_ms(self) -> float:
        return 1e3 * self.latency_samples / self.middle.sample_rate_hz

    def play(self, wanted: FloatArray, cap: CapPolicy | None = None) -> BandedForces:
        """Forces of all three bands for a wanted acceleration. wanted: (n, p), m/s². Raises ForceLimitError or
        TrackingError where the cap cannot be held."""
        bands = self.split.split(self._pad(wanted))
        low, motion = self._low_forces(bands.low)
        problem = make_tracking_problem(self.middle, self.weights)
        tracked = track(stored_gains(problem, len(low)), bands.middle)
        middle, answer, loss = tracked.forces, tracked.predicted, None
        high, share = self._high_forces(bands.high, low + middle)
        others = low if high is None else low + high.forces
        if cap is not None and cap.constrain:
            capped = track_under_cap(problem, bands.middle, cap.cap_n, others)
            middle, answer, loss = capped.forces, capped.predicted, capped.loss
        entering = middle + others
        by_band = (low, middle, others - low)
        return BandedForces(
            commands=entering - self._spring_force(motion, answer),
            entering=entering,
            by_band=by_band,
            predicted=self._predict_bands(by_band, motion, answer),
            bands=bands,
            latency_samples=self.latency_samples,
            peaks=None if cap is None else require_under_cap(entering, cap.cap_n, self._rate_hz),
            loss=loss,
            motion=motion,
            high=high,
            stylus=share,
        )

    @property
    def _rate_hz(self) -> float:
        return self.middle.sample_rate_hz

    @property
    def _padding(self) -> int:
        decay_s = 0.0 if self.low is None else LOW_BAND_DECAYS / (2 * np.pi * self.low.corner_hz)
        return int(np.ceil(max(PADDING_S, decay_s) * self._rate_hz))

    def _pad(self, wanted: FloatArray) -> FloatArray:
        """Pad with zeros, to a length with a fast FFT."""
        before = 0 if self.causal else self._padding
        around = 2 * self.split.latency_samples
        after = next_fast_len(len(wanted) + before + self._padding + around) - len(wanted) - before - around
        return np.pad(np.asarray(wanted, dtype=np.float64), ((before, after), (0, 0)))

    def _plan_motion(self, acceleration: FloatArray, corner_hz: float) -> SlowMotion:
        plan = plan_motion_causally if self.causal else plan_motion
        return plan(acceleration, self._rate_hz, corner_hz)

    def _low_forces(self, wanted: FloatArray) -> tuple[FloatArray, SlowMotion | None]:
        if self.low is None:
            return np.zeros((len(wanted), self.middle.B.shape[1])), None
        motion = self._plan_motion(wanted, self.low.corner_hz)
        return low_band_forces(motion, self.low.rigid, self._rate_hz), motion

    def _high_forces(self, wanted: FloatArray, others: FloatArray) -> tuple[HighBandForces | None, StylusShare | None]:
        if self.high is None:
            return None, None
        signal = project_to_one_dof(wanted) if self.causal else reduce_to_one_dof(wanted)
        share = None
        if self.high.stylus is not None:
            share = share_with_stylus(signal, self._rate_hz, self.high.stylus)
            signal = share.motors
        settings = replace(self.high.settings, causal=self.causal)
        return high_band_forces(signal, self._rate_hz, self.high.source, others, settings), share

    def _spring_force(self, motion: SlowMotion | None, middle: FloatArray) -> FloatArray:
        """The rendered spring's force along the motion of the two lower bands; the high band's motion is too small."""
        k, b = self.spring.stiffness_n_per_m, self.spring.damping_n_s_per_m
        if k == b == 0:
            return np.zeros_like(middle)
        motions = [self._plan_motion(middle, CORNER_HZ)] + ([] if motion is None else [motion])
        force: FloatArray = -sum((k * part.position_m + b * part.velocity_m_s for part in motions), np.zeros(()))
        return force

    def _predict_bands(
        self, by_band: tuple[FloatArray, FloatArray, FloatArray], motion: SlowMotion | None, answer: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        if self.high is not None:
            low, middle, high = (predict_acceleration(forces, self._rate_hz, self.high.source) for forces in by_band)
            return low, middle, high
        nothing = np.zeros_like(answer)
        return nothing if motion is None else motion.acceleration, answer, nothing
