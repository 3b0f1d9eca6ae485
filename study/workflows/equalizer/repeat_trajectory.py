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
from equalizer.tracking.feedforward.band_pass import filter_to_band
from equalizer.tracking.feedforward.virtual_spring import VirtualSpring
from equalizer.tracking.learning.convergence import Convergence
from equalizer.tracking.learning.iteration import LOWEST_GAIN, Verdict, find_largest_share
from equalizer.tracking.learning.model_inverse import compensate_spring
from equalizer.tracking.workspace.convergence_at_place import predict_convergence_at
from equalizer.tracking.workspace.feedforward_at_place import make_inverse_at_place
from study.session.views.handle_notice import BeforeMoving, refuse_unannounced
from study.store.formats.repeats_file import get_repeats_path
from study.workflows.equalizer.equalize_trajectory import (
    EqualizedTrajectory,
    EqualizePlan,
    require_new_output,
    solve_trajectory,
)
from study.workflows.equalizer.equalized_summary import format_equalization_lines, summarise_equalization
from study.workflows.equalizer.play_forces import (
    find_acting_spring,
    make_playback_settings,
    require_device_alone,
)
from study.workflows.equalizer.playback_models import PlaybackModels
from study.workflows.equalizer.repeat_playback import OnProgress, make_not_repeated_error, repeat_playback
from study.workflows.equalizer.repeat_results import RepeatPlan, RepeatResult, read_earlier_forces

SAFE_GAIN_FRACTION = 0.9
"""Factor on the largest gain with which every error decreases (`Convergence.safe_beta`). Chosen."""


@dataclass(frozen=True, slots=True)
class RepeatOptions:
    """Options of `repeat_trajectory`: number of corrections, device, earlier forces, seed."""

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

    equalized: EqualizedTrajectory
    options: RepeatOptions
    repeated: RepeatResult
    convergence: Convergence | None
    """Convergence test with `gain`; None for a single model that does not state its uncertainty."""
    gain: float
    """Upper bound of the gain beta of the corrections, dimensionless."""


def repeat_trajectory(
    plan: EqualizePlan,
    options: RepeatOptions,
    on_progress: OnProgress,
    before_moving: BeforeMoving = refuse_unannounced,
) -> RepeatedTrajectory:
    """Compute the forces, play and correct them, and write the table of forces and its document.

    Raises StudyError: before anything moves where an output exists or where cap, models, convergence test or earlier
    forces do not allow repeats; later where the device fails or the user interrupts.
    """
    require_new_output(plan.out, get_repeats_path(plan.out))
    equalized = solve_trajectory(plan)
    _require_repeatable(equalized.models)
    if equalized.feedforward.loss is not None:
        raise make_not_repeated_error(
            "The forces are at the cap already, so that there is no room to correct them.",
            "Scale the accelerations, or leave out --constrain or --repeat.",
        )
    spring = find_acting_spring(equalized.models)
    gain, convergence = _choose_gain(equalized, spring)
    repeat_plan = RepeatPlan(
        reference=equalized.reference,
        inverse=make_inverse_at_place(equalized.models.at_place, plan.weight),
        band_hz=equalized.models.band_hz,
        model_sha256=equalized.models.sha256,
        settings=make_playback_settings(plan.cap_n, equalized.models),
        device=options.device,
        repeats=options.repeats,
        first_gain=gain,
        spring=spring,
        first=_choose_initial_forces(equalized, options, spring),
        seed=options.seed,
        out=plan.out,
    )
    return RepeatedTrajectory(
        equalized, options, repeat_playback(repeat_plan, on_progress, before_moving), convergence, gain
    )


def summarise_repeats(result: RepeatedTrajectory) -> dict[str, Any]:
    """Summarise the results as plain values, for a JSON document. `errors`, `noise_floor`: rms relative to that of the
    reference trajectory, both in the band; `peak_n` in N; `surviving_error`: largest fraction of an error that remains
    after a correction, by the convergence test."""
    repeated = result.repeated
    return {
        **summarise_equalization(result.equalized),
        "peak_n": _compute_peak_n(repeated),
        "repeats": str(get_repeats_path(result.equalized.plan.out)),
        "errors": list(repeated.errors),
        "noise_floor": repeated.noise_floor,
        "kept": repeated.best_play,
        "verdict": repeated.verdict.name.lower(),
        "remark": repeated.remark,
        "gain": result.gain,
        "surviving_error": None if result.convergence is None else float(result.convergence.remaining_share.max()),
    }


def format_repeat_lines(result: RepeatedTrajectory) -> tuple[str, ...]:
    """Format the results as lines of text for the terminal: equalization, convergence test, error of each play (%), and
    the largest force (N)."""
    repeated = result.repeated
    # The last line is left out: it states the spring of the forces before the corrections.
    *equalized_lines, _ = format_equalization_lines(result.equalized)
    lines = [*equalized_lines, _describe_convergence(result)]
    for play_index, error in enumerate(repeated.errors):
        kept_text = ", kept" if play_index == repeated.best_play else ""
        lines.append(f"Play {play_index}: error {100 * error:.2f} % as measured{kept_text}.")
    lines.append(f"Noise alone: {100 * repeated.noise_floor:.2f} %. {_describe_verdict(result)}")
    if repeated.remark:
        lines.append(f"{capitalise(repeated.remark)}.")
    peak_text = f"The highest of the kept forces is {_compute_peak_n(repeated):.3g} N"
    return (*lines, f"{peak_text}; they are for the device under the spring that they were played under.")


def _compute_peak_n(repeated: RepeatResult) -> float:
    """Compute the largest magnitude (N) of the force vector over the samples of the best forces."""
    return float(np.linalg.norm(repeated.forces.signal.samples, axis=1).max())


def _describe_verdict(result: RepeatedTrajectory) -> str:
    """Describe in a sentence why the corrections ended."""
    repeated = result.repeated
    if repeated.verdict is Verdict.BEST_KEPT and len(repeated.errors) > result.options.repeats:
        return "All repeats were played; the best forces are kept."
    return f"{capitalise(repeated.verdict.value)}."


def _describe_convergence(result: RepeatedTrajectory) -> str:
    """Describe the convergence test in a sentence: largest fraction of the error that remains after a correction, and
    its frequency (Hz)."""
    if result.convergence is None:
        return "Convergence was not tested before playing: the model does not contain its uncertainty."
    return (
        "If the device is linear and within the models' uncertainty, at most "
        f"{100 * result.convergence.remaining_share.max():.1f} % of an error remains after a repeat "
        f"({result.convergence.worst_hz:.1f} Hz); with friction more remains. Gain {result.gain:.2f}."
    )


def _require_repeatable(models: PlaybackModels) -> None:
    """Raise StudyError for two models of one place, and for a model that was identified with a hand on the handle."""
    if models.two_bands is not None:
        raise make_not_repeated_error(
            "Two bands of one place were given, and of the upper one only the loudness is felt, so that its "
            "waveform cannot be corrected.",
            "Give the one model whose band shall be repeated.",
        )
    require_device_alone(models)


def _choose_gain(equalized: EqualizedTrajectory, spring: VirtualSpring) -> tuple[float, Convergence | None]:
    """Choose the gain of the corrections, and test the convergence with it: `SAFE_GAIN_FRACTION` of the largest gain
    with which every error decreases, at most 1. (1, None) where a single model does not state its uncertainty. Raises
    StudyError for a gain below `LOWEST_GAIN`."""
    models_at_place, weight = equalized.models.at_place, equalized.plan.weight
    convergence = predict_convergence_at(models_at_place, weight, spring)
    if convergence is None:
        return 1.0, None
    gain = min(1.0, SAFE_GAIN_FRACTION * convergence.safe_beta)
    if gain < LOWEST_GAIN:
        raise make_not_repeated_error(
            f"Repeats would not converge: at {convergence.worst_hz:.1f} Hz {convergence.remaining_share.max():.2f} of "
            "an error can remain after each with gain 1, within the models' uncertainty; a safe gain is below "
            f"{LOWEST_GAIN:g}.",
            "Record and identify at the place itself, or with more sweeps.",
        )
    return gain, convergence if gain == 1.0 else predict_convergence_at(models_at_place, weight, spring, gain)


def _choose_initial_forces(
    equalized: EqualizedTrajectory, options: RepeatOptions, spring: VirtualSpring
) -> FloatArray | None:
    """Choose the forces of the first playback, (N, 3) in N: those of an earlier run, or the solution with compensated
    nonlinear effects plus the compensation of the spring. None where neither applies: `repeat_playback` then computes
    them from the model."""
    if options.earlier is not None:
        return read_earlier_forces(options.earlier, equalized.reference, equalized.models.sha256)
    if equalized.compensation is None:
        return None
    rate_hz, band_hz = equalized.reference.signal.sample_rate_hz, equalized.models.band_hz
    forces = equalized.forces.signal.samples
    reference = filter_to_band(equalized.reference.signal.samples, rate_hz, band_hz)
    spring_compensation = compensate_spring(lambda _: np.zeros_like(forces), spring, rate_hz, band_hz)(reference)
    # Where the cap does not allow the whole compensation of the spring, a share of it is added; repeats correct the
    # rest.
    return forces + find_largest_share(forces, spring_compensation, equalized.plan.cap_n) * spring_compensation
