"""Iterative learning control of a trajectory on a device (`hapteq equalize --repeat N`).

`solve_trajectory` computes forces from the model; the convergence test of `equalizer.tracking.learning.convergence`
limits the gain of the corrections; `repeat_playback` then plays the forces, measures the error of the acceleration and
corrects the forces by the inverse of the model. The corrected forces are valid for the virtual spring that acted.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from analysis.wording import capitalise
from equalizer.signals.signal import FloatArray
from equalizer.tracking.feedforward.band_part import band_part
from equalizer.tracking.feedforward.virtual_spring import VirtualSpring
from equalizer.tracking.learning.convergence import Convergence
from equalizer.tracking.learning.iteration import LOWEST_GAIN, Verdict, largest_share
from equalizer.tracking.learning.model_inverse import compensate_spring
from equalizer.tracking.workspace.convergence_at_place import convergence_at
from equalizer.tracking.workspace.feedforward_at_place import inverse_at
from study.session.views.handle_notice import BeforeMoving, refuse_unannounced
from study.store.formats.repeats_file import repeats_path
from study.workflows.equalizer.equalize_trajectory import (
    EqualizedTrajectory,
    EqualizePlan,
    check_free,
    solve_trajectory,
)
from study.workflows.equalizer.equalized_summary import summary, summary_lines
from study.workflows.equalizer.play_forces import (
    find_acting_spring,
    playback_settings,
    require_device_alone,
)
from study.workflows.equalizer.playback_models import PlaybackModels
from study.workflows.equalizer.repeat_playback import OnProgress, not_repeated, repeat_playback
from study.workflows.equalizer.repeat_results import Repeated, RepeatPlan, earlier_forces

SAFE_SHARE = 0.9
"""Ratio of the gain that is used to the largest gain with which every error decreases (`Convergence.safe_beta`)."""


@dataclass(frozen=True, slots=True)
class RepeatOrder:
    """Order of `repeat_trajectory`: number of corrections, device, and options."""

    repeats: int
    """Number of corrections after the first play."""
    device: str
    """Name of the device, as `open_device` takes it."""
    earlier: Path | None = None
    """Table of forces of an earlier run to continue from."""
    seed: int = 1
    """Seed of a simulated device."""


@dataclass(frozen=True, slots=True, eq=False)
class RepeatedTrajectory:
    """Result of `repeat_trajectory`: the solution from the models, and the forces corrected by repeated playback."""

    solved: EqualizedTrajectory
    order: RepeatOrder
    repeated: Repeated
    tested: Convergence | None
    """Convergence test with `gain`; None for a single model that does not state its uncertainty."""
    gain: float
    """Upper bound of the gain beta of the corrections, dimensionless."""


def repeat_trajectory(
    plan: EqualizePlan, order: RepeatOrder, on_progress: OnProgress, before_moving: BeforeMoving = refuse_unannounced
) -> RepeatedTrajectory:
    """Compute the forces, play and correct them, and write the table of forces and its document.

    Raises StudyError: before anything moves where an output exists or where cap, models or convergence test do not
    allow repeats; later where the device fails or the user interrupts.
    """
    check_free(plan.out, repeats_path(plan.out))
    solved = solve_trajectory(plan)
    _require_repeatable(solved.models)
    if solved.solved.loss is not None:
        raise not_repeated(
            "The forces are at the cap already, so that there is no room to correct them.",
            "Scale the accelerations, or leave out --constrain or --repeat.",
        )
    spring = find_acting_spring(solved.models)
    gain, tested = _test_gain(solved, spring)
    repeat_plan = RepeatPlan(
        wanted=solved.wanted,
        inverse=inverse_at(solved.models.at, plan.weight),
        band_hz=solved.models.band_hz,
        model_sha256=solved.models.sha256,
        settings=playback_settings(plan.cap_n, solved.models),
        device=order.device,
        repeats=order.repeats,
        first_gain=gain,
        spring=spring,
        first=_initial_forces(solved, order, spring),
        seed=order.seed,
        out=plan.out,
    )
    return RepeatedTrajectory(solved, order, repeat_playback(repeat_plan, on_progress, before_moving), tested, gain)


def repeat_summary(done: RepeatedTrajectory) -> dict[str, Any]:
    """Results as plain values. `errors`, `noise_floor`: relative to the wanted signal; `peak_n` in N."""
    found = done.repeated
    return {
        **summary(done.solved),
        "peak_n": _peak_n(found),
        "repeats": str(repeats_path(done.solved.plan.out)),
        "errors": list(found.errors),
        "noise_floor": found.noise_floor,
        "kept": found.kept,
        "verdict": found.verdict.name.lower(),
        "remark": found.remark,
        "gain": done.gain,
        "surviving_error": None if done.tested is None else float(done.tested.surviving.max()),
    }


def repeat_lines(done: RepeatedTrajectory) -> tuple[str, ...]:
    """Results as lines of text for the terminal."""
    found = done.repeated
    *alone, _ = summary_lines(done.solved)  # the last line states the spring of the solved forces
    lines = [*alone, _convergence_line(done)]
    for number, error in enumerate(found.errors):
        kept = ", kept" if number == found.kept else ""
        lines.append(f"Play {number}: error {100 * error:.2f} % as measured{kept}.")
    lines.append(f"Noise alone: {100 * found.noise_floor:.2f} %. {_verdict(done)}")
    if found.remark:
        lines.append(f"{capitalise(found.remark)}.")
    strongest = f"The highest of the kept forces is {_peak_n(found):.3g} N"
    return (*lines, f"{strongest}; they are for the device under the spring that they were played under.")


def _peak_n(found: Repeated) -> float:
    """Largest magnitude of the force vector in a row, N."""
    return float(np.linalg.norm(found.forces.signal.samples, axis=1).max())


def _verdict(done: RepeatedTrajectory) -> str:
    """Sentence on why the repeats ended."""
    found = done.repeated
    if found.verdict is Verdict.BEST_KEPT and len(found.errors) > done.order.repeats:
        return "All repeats were played; the best forces are kept."
    return f"{capitalise(found.verdict.value)}."


def _convergence_line(done: RepeatedTrajectory) -> str:
    """Sentence on the convergence test: worst-case share of the error that remains, and its frequency."""
    if done.tested is None:
        return "Convergence was not tested before playing: the model does not contain its uncertainty."
    return (
        "If the device is linear and within the models' uncertainty, at most "
        f"{100 * done.tested.surviving.max():.1f} % of an error remains after a repeat ({done.tested.worst_hz:.1f} "
        f"Hz); with friction more remains. Gain {done.gain:.2f}."
    )


def _require_repeatable(models: PlaybackModels) -> None:
    """Raise StudyError for two models of one place, and for a model that was identified with a hand on the handle."""
    if models.two is not None:
        raise not_repeated(
            "Two bands of one place were given, and of the upper one only the loudness is felt, so that its "
            "waveform cannot be corrected.",
            "Give the one model whose band shall be repeated.",
        )
    require_device_alone(models)


def _test_gain(solved: EqualizedTrajectory, spring: VirtualSpring) -> tuple[float, Convergence | None]:
    """Gain of the corrections: `SAFE_SHARE` of the largest gain that converges, at most 1; 1 without a test. And the
    convergence test with this gain. Raises StudyError for a gain below `LOWEST_GAIN`."""
    at, weight = solved.models.at, solved.plan.weight
    tested = convergence_at(at, weight, spring)
    if tested is None:
        return 1.0, None
    gain = min(1.0, SAFE_SHARE * tested.safe_beta)
    if gain < LOWEST_GAIN:
        raise not_repeated(
            f"Repeats would not converge: at {tested.worst_hz:.1f} Hz {tested.surviving.max():.2f} of an error can "
            "remain after each with gain 1, within the models' uncertainty; a safe gain is below "
            f"{LOWEST_GAIN:g}.",
            "Record and identify at the place itself, or with more sweeps.",
        )
    return gain, tested if gain == 1.0 else convergence_at(at, weight, spring, gain)


def _initial_forces(solved: EqualizedTrajectory, order: RepeatOrder, spring: VirtualSpring) -> FloatArray | None:
    """(N, 3): initial forces in N, from an earlier run, or from the solution with compensated effects plus the
    compensation of the spring. None: the first play computes them from the model."""
    if order.earlier is not None:
        return earlier_forces(order.earlier, solved.wanted, solved.models.sha256)
    if solved.compensation is None:
        return None
    rate_hz, band_hz = solved.wanted.signal.sample_rate_hz, solved.models.band_hz
    forces = solved.forces.signal.samples
    wanted = band_part(solved.wanted.signal.samples, rate_hz, band_hz)
    held = compensate_spring(lambda _: np.zeros_like(forces), spring, rate_hz, band_hz)(wanted)
    # Where the cap does not allow the whole compensation of the spring, a share of it is added; repeats correct the
    # rest.
    return forces + largest_share(forces, held, solved.plan.cap_n) * held
