"""Arguments and result of repeated playback (iterative learning control), and their files.

The best forces are written as a table, with a JSON document next to it. A later run continues from these forces only if
trajectory, model and table are unchanged (SHA-256).
"""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from equalizer.signals.signal import FloatArray, Signal
from equalizer.tracking.feedforward.trajectory import FORCES, Trajectory, format_trajectory_csv
from equalizer.tracking.feedforward.virtual_spring import NO_SPRING, VirtualSpring
from equalizer.tracking.learning.iteration import IterationState, Verdict
from equalizer.tracking.learning.model_inverse import InverseOfLength
from study.devices.device import DeviceSettings, PlaybackResult
from study.errors import StudyError
from study.store.disk.provenance import gather_provenance
from study.store.formats.repeats_file import Repeats, get_repeats_path, read_repeats, write_repeats
from study.store.formats.trajectory_file import read_trajectory, write_trajectory


@dataclass(frozen=True, slots=True, eq=False)
class RepeatPlan:
    """Arguments of repeated playback: reference motion, inverse of the model, settings of the device, number of
    corrections."""

    reference: Trajectory
    """Reference accelerations (m/s²), from rest to rest; only their part in the band is played."""
    inverse: InverseOfLength
    """Inverse of the model, from reference accelerations to forces."""
    band_hz: tuple[float, float]
    """Lower and upper end of the band in which the motion is corrected."""
    model_sha256: str
    """SHA-256 of the models behind the inverse: forces are reused for the same models only."""
    settings: DeviceSettings
    """Settings without a hand on the handle. Every correction respects the cap of the stimulus."""
    device: str
    """Name of the device, as given with `--device`."""
    repeats: int = 10
    """Number of corrections after the first play."""
    first_gain: float = 1.0
    """Gain beta of the first correction, see `equalizer.tracking.learning.convergence`."""
    spring: VirtualSpring = NO_SPRING
    """Spring that acts on the device and is not in the model already."""
    first: FloatArray | None = None
    """(N, 3), N: forces of the first play, one row per sample of the reference; None: those of the model."""
    seed: int = 0
    """Seed of a simulated device."""
    out: Path | None = None
    """Table of forces to write, and the document next to it; None: nothing is written."""


@dataclass(frozen=True, slots=True, eq=False)
class RepeatResult:
    """Result of repeated playback: the best forces, and the error of each play."""

    forces: Trajectory
    """The best forces, one row per sample of the reference."""
    errors: tuple[float, ...]
    """Relative error in the band of each play as measured (1 = 100 %), noise included."""
    noise_floor: float
    """Relative error that noise alone causes; 0 where it is not known."""
    verdict: Verdict
    """Reason why the repetition ended."""
    best_play: int
    """Index of the play with the smallest residual, from 0: that of the best forces."""
    remark: str
    """As `IterationState.remark`."""
    plays: tuple[PlaybackResult, ...]
    """Recordings of all plays, in order."""


def make_result(plan: RepeatPlan, state: IterationState, plays: list[PlaybackResult]) -> RepeatResult:
    """Make the result after the last play, of at least one."""
    return RepeatResult(
        forces=_make_force_table(plan, state),
        errors=state.errors,
        noise_floor=_compute_relative_noise_floor(state),
        verdict=_find_final_verdict(state),
        best_play=int(np.argmin(state.residuals)),
        remark=state.remark,
        plays=tuple(plays),
    )


def _find_final_verdict(state: IterationState) -> Verdict:
    """Find the verdict of a repetition that has ended: BEST_KEPT where it could have continued (its number of
    corrections is used up)."""
    return Verdict.BEST_KEPT if state.verdict is Verdict.CONTINUE else state.verdict


def _make_force_table(plan: RepeatPlan, state: IterationState) -> Trajectory:
    """Make a table of the best forces, cut to the length of the reference."""
    sample_count, rate_hz = len(plan.reference.signal), plan.reference.signal.sample_rate_hz
    signal = Signal(state.best_forces[:sample_count], rate_hz, FORCES.quantity, FORCES.unit, FORCES.header[1:])
    return Trajectory(signal, plan.reference.start_s)


def _compute_relative_noise_floor(state: IterationState) -> float:
    """Divide the noise floor by the rms of the reference in the band; 0 where the noise is not known."""
    return (state.noise_floor or 0.0) / state.settings.level


def write_best_forces(plan: RepeatPlan, state: IterationState, interrupted: bool) -> None:
    """Write the best forces so far to `plan.out`, and the document next to it; nothing where that is None. interrupted:
    whether the repetition was stopped by the user or by a fault of the device. Raises CannotWriteError."""
    if plan.out is None:
        return
    table = _make_force_table(plan, state)
    write_trajectory(plan.out, table)
    repeats = Repeats(
        trajectory_sha256=hash_trajectory(plan.reference),
        model_sha256=plan.model_sha256,
        forces_sha256=_hash_text(format_trajectory_csv(table)),
        device=plan.device,
        place_m=plan.settings.place_m,
        band_hz=plan.band_hz,
        errors=state.errors,
        kept=int(np.argmin(state.residuals)),
        noise_floor=_compute_relative_noise_floor(state),
        gains=state.gains,
        fitted=state.scales,
        verdict=_find_final_verdict(state).name.lower(),
        remark=state.remark,
        interrupted=interrupted,
    )
    write_repeats(get_repeats_path(plan.out), repeats, gather_provenance(seeds={"device": plan.seed}))


def read_earlier_forces(forces_path: Path, reference: Trajectory, model_sha256: str) -> FloatArray:
    """Read the forces, (N, 3) in N, that an earlier run computed for the same trajectory and model. forces_path: their
    table. Raises StudyError if trajectory or model differ, the table was changed, or a file cannot be read."""
    document, table = read_repeats(get_repeats_path(forces_path)), read_trajectory(forces_path)
    matches_by_subject = {
        "another trajectory": document.trajectory_sha256 == hash_trajectory(reference),
        "another model": document.model_sha256 == model_sha256,
        "a table of forces that was changed since": document.forces_sha256 == _hash_text(format_trajectory_csv(table)),
    }
    if differing_subjects := [subject for subject, is_match in matches_by_subject.items() if not is_match]:
        raise StudyError(
            "The repeats cannot continue from the earlier forces",
            f"{get_repeats_path(forces_path).name} belongs to {' and '.join(differing_subjects)}.",
            "Leave it out to begin with the model's own forces.",
            saved="Nothing moved.",
        )
    return table.signal.samples


def hash_trajectory(reference: Trajectory) -> str:
    """Compute the SHA-256 (hexadecimal) of sample rate and samples of a trajectory, as little-endian float64."""
    rate_bytes = np.float64(reference.signal.sample_rate_hz).tobytes()
    return hashlib.sha256(rate_bytes + reference.signal.samples.astype("<f8").tobytes()).hexdigest()


def _hash_text(text: str) -> str:
    """Compute the SHA-256 of a text in UTF-8, in hexadecimal digits."""
    return hashlib.sha256(text.encode()).hexdigest()
