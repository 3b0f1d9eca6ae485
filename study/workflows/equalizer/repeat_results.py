"""Order and result of repeated playback, stored as a table of forces with a document beside it."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from equalizer.signals.signal import FloatArray, Signal
from equalizer.tracking.feedforward.trajectory import FORCES, Trajectory, trajectory_csv
from equalizer.tracking.feedforward.virtual_spring import NO_SPRING, VirtualSpring
from equalizer.tracking.learning.iteration import IterationState, Verdict
from equalizer.tracking.learning.model_inverse import InverseOfLength
from study.devices.device import DeviceSettings, Played
from study.errors import StudyError
from study.store.disk.provenance import gather_provenance
from study.store.formats.repeats_file import Repeats, read_repeats, repeats_path, write_repeats
from study.store.formats.trajectory_file import read_trajectory, write_trajectory


@dataclass(frozen=True, slots=True, eq=False)
class RepeatPlan:
    """Order of repeated playback: wanted signal, inverse of the model, settings of the device, number of
    corrections."""

    wanted: Trajectory
    """Accelerations, from rest to rest; only their part in the band is played."""
    inverse: InverseOfLength
    band_hz: tuple[float, float]
    model_sha256: str
    """Hash of the models behind the inverse: forces are reused for the same models only."""
    settings: DeviceSettings
    """Without a hand on the handle. Every correction respects the stimulus' cap."""
    device: str
    repeats: int = 10
    """After the first play."""
    first_gain: float = 1.0
    """See `equalizer.tracking.learning.convergence`."""
    spring: VirtualSpring = NO_SPRING
    """Spring that acts on the device and is not in the model already."""
    first: FloatArray | None = None
    """(N, 3): forces to start from, one to one with the wanted signal; None = the model's."""
    seed: int = 0
    out: Path | None = None
    """Table of forces to write; the document is written beside it."""


@dataclass(frozen=True, slots=True, eq=False)
class Repeated:
    """Result of repeated playback: the best forces, and the error of each play."""

    forces: Trajectory
    """The best forces, one to one with the wanted signal."""
    errors: tuple[float, ...]
    """Relative error in the band of each play as measured, noise included."""
    noise_floor: float
    """Relative error of noise alone."""
    verdict: Verdict
    kept: int
    """Number of the play with these forces, from 0."""
    remark: str
    played: tuple[Played, ...]


def make_result(plan: RepeatPlan, state: IterationState, played: list[Played]) -> Repeated:
    """The result after the last play."""
    verdict = Verdict.BEST_KEPT if state.verdict is Verdict.CONTINUE else state.verdict
    return Repeated(
        forces=_table(plan, state),
        errors=state.errors,
        noise_floor=_floor(state),
        verdict=verdict,
        kept=int(np.argmin(state.residuals)),
        remark=state.remark,
        played=tuple(played),
    )


def _table(plan: RepeatPlan, state: IterationState) -> Trajectory:
    rows, rate_hz = len(plan.wanted.signal), plan.wanted.signal.sample_rate_hz
    signal = Signal(state.best[:rows], rate_hz, FORCES.quantity, FORCES.unit, FORCES.header[1:])
    return Trajectory(signal, plan.wanted.start_s)


def _floor(state: IterationState) -> float:
    return (state.noise_floor or 0.0) / state.repetition.level


def write_repeated(plan: RepeatPlan, state: IterationState, interrupted: bool) -> None:
    """Write forces and document."""
    if plan.out is None:
        return
    table = _table(plan, state)
    write_trajectory(plan.out, table)
    verdict = Verdict.BEST_KEPT if state.verdict is Verdict.CONTINUE else state.verdict
    repeats = Repeats(
        trajectory_sha256=trajectory_sha256(plan.wanted),
        model_sha256=plan.model_sha256,
        forces_sha256=_text_sha256(trajectory_csv(table)),
        device=plan.device,
        place_m=plan.settings.place_m,
        band_hz=plan.band_hz,
        errors=state.errors,
        kept=int(np.argmin(state.residuals)),
        noise_floor=_floor(state),
        gains=state.gains,
        fitted=state.fitted,
        verdict=verdict.name.lower(),
        remark=state.remark,
        interrupted=interrupted,
    )
    write_repeats(repeats_path(plan.out), repeats, gather_provenance(seeds={"device": plan.seed}))


def earlier_forces(forces: Path, wanted: Trajectory, model_sha256: str) -> FloatArray:
    """(N, 3): forces that an earlier run found for the same trajectory and model. Raises StudyError for others."""
    document, table = read_repeats(repeats_path(forces)), read_trajectory(forces)
    found = {
        "another trajectory": document.trajectory_sha256 == trajectory_sha256(wanted),
        "another model": document.model_sha256 == model_sha256,
        "a table of forces that was changed since": document.forces_sha256 == _text_sha256(trajectory_csv(table)),
    }
    if wrong := [what for what, same in found.items() if not same]:
        raise StudyError(
            "The earlier forces cannot be gone on from",
            f"{repeats_path(forces).name} belongs to {' and '.join(wrong)}.",
            "Leave it out to begin with the model's own forces.",
            saved="Nothing moved.",
        )
    return table.signal.samples


def trajectory_sha256(wanted: Trajectory) -> str:
    """SHA-256 of sample rate and samples: forces of an earlier run are reused for the same trajectory only."""
    rate = np.float64(wanted.signal.sample_rate_hz).tobytes()
    return hashlib.sha256(rate + wanted.signal.samples.astype("<f8").tobytes()).hexdigest()


def _text_sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
