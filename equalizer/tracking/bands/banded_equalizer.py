"""Feedforward equalizer: forces that make a device follow a reference acceleration, solved in three frequency bands.

An identified model is valid in a limited band only. Low band: inverse dynamics of a rigid model along a planned motion
(`low_band`). Middle: linear-quadratic tracking with the identified model (`lqr`). High: one degree of freedom along the
direction of the smallest peak force (`high_band`). The forces are added. Without edges in the split, all is middle
band.

Shapes: n rows of the reference, N rows with delays and padding, m axes of force (N), p axes of acceleration (m/s²). As
many forces as accelerations are required, which is not checked: the force of the virtual spring, (N, p), is subtracted
from the commands.
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
    compute_high_band_forces,
    predict_acceleration,
    project_to_one_dof,
    reduce_to_one_dof,
)
from equalizer.tracking.bands.low_band import (
    CORNER_HZ,
    SlowMotion,
    compute_low_band_forces,
    plan_motion,
    plan_motion_causally,
)
from equalizer.tracking.bands.rigid_model import RigidModel
from equalizer.tracking.bands.stylus import StylusActuator, StylusShare, share_with_stylus
from equalizer.tracking.feedforward.band_split import CausalSplit, LinearPhaseSplit
from equalizer.tracking.feedforward.virtual_spring import NO_SPRING, VirtualSpring
from equalizer.tracking.lqr.constrained import track_under_cap
from equalizer.tracking.lqr.limits import require_under_cap
from equalizer.tracking.lqr.lqr import compute_stored_gains, track
from equalizer.tracking.lqr.tracking_problem import TrackingWeights, make_tracking_problem

MIN_PADDING_S = 0.3
"""Least duration (s) of the zeros added before and after the reference. The inverse is non-causal: a constant force
causes no lasting acceleration, so that forces begin before and end after the reference acceleration. Chosen."""
PADDING_DECAYS = 6.0
"""Duration of the padding, in time constants of the low band's return to rest. A shorter padding would cut off a force
that has not decayed, which excites the device; after six, exp(-6) = 0.25 % remains. Chosen."""
MIN_FORCE_WEIGHT, MAX_FORCE_WEIGHT = 1e-3, 1e-2
"""Allowed range of the force weight R (`TrackingWeights.weight`), (m/s² per N)². Below it, forces drift at frequencies
outside the identified band; above it, the delivered level is too low. Chosen by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class LowBand:
    """Low band: the rigid model whose inverse dynamics give its forces, and the high-pass corner of its motion (Hz)."""

    rigid: RigidModel
    corner_hz: float = CORNER_HZ


@dataclass(frozen=True, slots=True, eq=False)
class HighBand:
    """High band, rendered with one degree of freedom; a stylus actuator, if present, renders its upper part."""

    source: ResponseSource
    """Frequency response of the device over the whole high band."""
    settings: HighBandSettings = field(default_factory=HighBandSettings)
    """Settings; `causal` is replaced by whether the split is causal."""
    stylus: StylusActuator | None = None
    """None where the motors render the whole high band."""


@dataclass(frozen=True, slots=True)
class CapPolicy:
    """Cap (N) on the norm of the total force vector of all bands, and what happens if forces exceed it."""

    cap_n: float
    constrain: bool = False
    """False: forces above the cap raise ForceLimitError. True: the middle band is solved again, so that its sum with
    the other bands is under the cap."""


@dataclass(frozen=True, slots=True, eq=False)
class BandedEqualizer:
    """The equalizer of a device. Raises ValueError if the split and the models disagree on bands, or the split and the
    middle model on the sample rate, for a force weight outside its allowed range, and for a stylus actuator with a
    causal split."""

    middle: IdentifiedModel
    """Identified model of the middle band."""
    split: LinearPhaseSplit | CausalSplit
    """Filters that split the reference into bands. With a causal split all forces are causal: they begin with the first
    row of the reference, as at a contact."""
    low: LowBand | None = None
    """None exactly where the split has no lower edge."""
    high: HighBand | None = None
    """None exactly where the split has no upper edge."""
    weights: TrackingWeights = field(default_factory=TrackingWeights)
    """Weights of the middle band's tracking."""
    spring: VirtualSpring = NO_SPRING
    """Spring of the device's control loop, whose force is subtracted from the commands."""

    def __post_init__(self) -> None:
        for band_name, edge_hz, band_model in (
            ("low", self.split.edges.low_hz, self.low),
            ("high", self.split.edges.high_hz, self.high),
        ):
            if edge_hz is not None and band_model is None:
                raise ValueError(
                    f"the split has a {band_name} band with the edge {edge_hz:g} Hz, but there is no model to play it"
                )
            if edge_hz is None and band_model is not None:
                raise ValueError(f"there is a model for a {band_name} band, but the split has none")
        if self.causal and self.high is not None and self.high.stylus is not None:
            raise ValueError(
                "the share of a stylus actuator has no causal form: it would begin before the contact; use a "
                "linear-phase split, or leave the stylus out"
            )
        if not MIN_FORCE_WEIGHT <= self.weights.weight <= MAX_FORCE_WEIGHT:
            raise ValueError(
                f"weight is {self.weights.weight}; it must be within {MIN_FORCE_WEIGHT:g} and {MAX_FORCE_WEIGHT:g}"
            )
        if self.split.sample_rate_hz != self.middle.sample_rate_hz:
            raise ValueError(
                f"the split is at {self.split.sample_rate_hz:g} Hz, the model at {self.middle.sample_rate_hz:g} Hz"
            )

    @property
    def causal(self) -> bool:
        """Whether the split is causal: forces then begin with the first row of the reference."""
        return isinstance(self.split, CausalSplit)

    @property
    def latency_samples(self) -> int:
        """Number of rows of the forces before the first row of the reference: delay of the filters, and padding unless
        causal."""
        return self.split.latency_samples + (0 if self.causal else self._padding_rows)

    @property
    def latency_ms(self) -> float:
        """`latency_samples` in ms."""
        return 1e3 * self.latency_samples / self.middle.sample_rate_hz

    def compute_forces(self, reference: FloatArray, cap: CapPolicy | None = None) -> BandedForces:
        """Compute the forces of all three bands for a reference acceleration. reference: (n, p), m/s²; cap: None = no
        limit. Raises ForceLimitError for forces above the cap, TrackingError if no forces under it are found,
        ValueError for an unsuitable reference."""
        bands = self.split.split(self._pad_reference(reference))
        low_forces, motion = self._compute_low_forces(bands.low)
        problem = make_tracking_problem(self.middle, self.weights)
        middle_track = track(compute_stored_gains(problem, len(low_forces)), bands.middle)
        middle_forces, middle_response, loss = middle_track.forces, middle_track.predicted, None
        high_result, stylus_share = self._compute_high_forces(bands.high, low_forces + middle_forces)
        other_forces = low_forces if high_result is None else low_forces + high_result.forces
        if cap is not None and cap.constrain:
            capped_track = track_under_cap(problem, bands.middle, cap.cap_n, other_forces)
            middle_forces, middle_response, loss = capped_track.forces, capped_track.predicted, capped_track.loss
        total_forces = middle_forces + other_forces
        by_band = (low_forces, middle_forces, other_forces - low_forces)
        return BandedForces(
            commands=total_forces - self._compute_spring_force(motion, middle_response),
            total_forces=total_forces,
            by_band=by_band,
            predicted=self._predict_bands(by_band, motion, middle_response),
            bands=bands,
            latency_samples=self.latency_samples,
            peaks=None if cap is None else require_under_cap(total_forces, cap.cap_n, self._rate_hz),
            loss=loss,
            motion=motion,
            high=high_result,
            stylus=stylus_share,
        )

    @property
    def _rate_hz(self) -> float:
        """Sample rate (Hz) of the model and the split."""
        return self.middle.sample_rate_hz

    @property
    def _padding_rows(self) -> int:
        """Number of rows of zeros before and after the reference."""
        padding_decay_s = 0.0 if self.low is None else PADDING_DECAYS / (2 * np.pi * self.low.corner_hz)
        return int(np.ceil(max(MIN_PADDING_S, padding_decay_s) * self._rate_hz))

    def _pad_reference(self, reference: FloatArray) -> FloatArray:
        """Pad reference (n, p) with zeros, so that an FFT of N rows is fast; if causal, only at the end."""
        rows_before = 0 if self.causal else self._padding_rows
        filter_rows = 2 * self.split.latency_samples
        rows_after = (
            next_fast_len(len(reference) + rows_before + self._padding_rows + filter_rows)
            - len(reference)
            - rows_before
            - filter_rows
        )
        return np.pad(np.asarray(reference, dtype=np.float64), ((rows_before, rows_after), (0, 0)))

    def _plan_motion(self, acceleration: FloatArray, corner_hz: float) -> SlowMotion:
        """Plan the motion whose acceleration is `acceleration` (N, p), m/s², above a corner frequency: by a causal
        filter for a causal split, else by a zero-phase one."""
        plan_for_split = plan_motion_causally if self.causal else plan_motion
        return plan_for_split(acceleration, self._rate_hz, corner_hz)

    def _compute_low_forces(self, reference: FloatArray) -> tuple[FloatArray, SlowMotion | None]:
        """Compute the forces (N, m) of the low band and its planned motion; zeros and None without a low band."""
        if self.low is None:
            return np.zeros((len(reference), self.middle.B.shape[1])), None
        motion = self._plan_motion(reference, self.low.corner_hz)
        return compute_low_band_forces(motion, self.low.rigid, self._rate_hz), motion

    def _compute_high_forces(
        self, reference: FloatArray, other_forces: FloatArray
    ) -> tuple[HighBandForces | None, StylusShare | None]:
        """Compute the forces of the high band and the share of the stylus; None where absent. other_forces: (N, m), N,
        the forces of the other bands."""
        if self.high is None:
            return None, None
        one_dof_reference = project_to_one_dof(reference) if self.causal else reduce_to_one_dof(reference)
        stylus_share = None
        if self.high.stylus is not None:
            stylus_share = share_with_stylus(one_dof_reference, self._rate_hz, self.high.stylus)
            one_dof_reference = stylus_share.motors
        settings = replace(self.high.settings, causal=self.causal)
        return compute_high_band_forces(
            one_dof_reference, self._rate_hz, self.high.source, other_forces, settings
        ), stylus_share

    def _compute_spring_force(self, motion: SlowMotion | None, middle_response: FloatArray) -> FloatArray:
        """Compute the force -(k x + b v), (N, p), N, of the virtual spring along the motion of the low and the middle
        band; that of the high band is negligible. middle_response: (N, p), m/s², predicted acceleration of the middle
        band."""
        k, b = self.spring.stiffness_n_per_m, self.spring.damping_n_s_per_m
        if k == b == 0:
            return np.zeros((len(middle_response), self.middle.B.shape[1]))
        planned_motions = [self._plan_motion(middle_response, CORNER_HZ)] + ([] if motion is None else [motion])
        force: FloatArray = -sum(
            (k * motion_part.position_m + b * motion_part.velocity_mps for motion_part in planned_motions), np.zeros(())
        )
        return force

    def _predict_bands(
        self, by_band: tuple[FloatArray, FloatArray, FloatArray], motion: SlowMotion | None, middle_response: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Predict the acceleration (N, p), m/s², of each band: by the high band's frequency response if there is a high
        band, because it is defined at all frequencies; else by each band's model. middle_response: the middle
        model's."""
        if self.high is not None:
            low_acceleration, middle_acceleration, high_acceleration = (
                predict_acceleration(forces, self._rate_hz, self.high.source) for forces in by_band
            )
            return low_acceleration, middle_acceleration, high_acceleration
        zeros = np.zeros_like(middle_response)
        return zeros if motion is None else motion.acceleration_mps2, middle_response, zeros
