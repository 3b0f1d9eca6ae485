"""Play a recorded acceleration transient along the normal of a contact: `hapteq contact` (`study.cli.contact`).

The causal tracking problem (`equalizer.tracking.lqr.contact`) is solved for each of the three axes before the contact.
At the contact the normal n is known: the forces are sum_i n_i F_i(t). The comparison is a force along n with one gain.
"""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from equalizer.signals.signal import FloatArray, Signal
from equalizer.tracking.feedforward.band_pass import filter_to_band
from equalizer.tracking.feedforward.baselines import make_static_gain_inverse
from equalizer.tracking.feedforward.trajectory import FORCES, TRAJECTORY, TRANSIENT, Trajectory, require_rate
from equalizer.tracking.learning.model_inverse import compensate_spring
from equalizer.tracking.lqr.contact import ContactSolutions, prepare_causal_start
from equalizer.tracking.lqr.limits import ForceLimitError, require_under_cap, round_scale_down
from equalizer.tracking.lqr.padding import Padding, compute_band_error
from equalizer.tracking.lqr.tracking_problem import TrackingWeights, make_tracking_problem
from study.devices.clock import RealClock, VirtualClock
from study.devices.device import Device, DeviceSettings, Fault
from study.devices.opening import needs_real_time, open_device
from study.errors import DeviceError, StudyError, UserInterruptError, WrongUseError
from study.session.stimulus.limits import SPRING_SLEW_N_PER_S
from study.session.views.handle_notice import BeforeMoving, refuse_unannounced
from study.store.disk.json_document import write_json
from study.store.disk.new_folder import create_new_folder, require_new_folder
from study.store.disk.provenance import gather_provenance
from study.store.formats.trajectory_file import read_trajectory, write_trajectory
from study.workflows.equalizer.play_forces import (
    announce_motion,
    find_acting_spring,
    make_playback_settings,
    play_forces,
    read_measured_acceleration,
    require_device_alone,
)
from study.workflows.equalizer.playback_models import PlaybackModels, Vector, read_playback_models

GAIN_LINES = 100  # frequencies in the band, a geometric series, over which the gain of the comparison is averaged
PADDING = Padding(after_s=0.5)  # played after the recording, for the handle to come to rest; chosen
FADE_S = 0.2  # fade-out (s) at the end, where the forces of the solution with a free end would stop with a step; chosen
RESTART, UNSAVED = "Start again.", "Nothing was written."  # remedy and saved data in the error of an interrupted play
SETTLE_S = 1.0  # time (s) without stimulus before and after each play; chosen


@dataclass(frozen=True, slots=True)
class ContactPlan:
    """Arguments of `play_contact`. normal: contact normal, of any length above zero; scale: factor on the recording;
    weight: of the forces in the cost, (m/s² per N)²; cap_n: largest force (N); seed: of a simulated device."""

    model: Path
    transient: Path
    normal: Vector
    out: Path
    device: str = "simulated"
    scale: float = 1.0
    weight: float = 1e-3
    cap_n: float = 3.0
    seed: int = 1


@dataclass(frozen=True, slots=True, eq=False)
class PlayedTransient:
    """A play of the transient: commands (N, 3), N, and measured acceleration (N, 3), m/s², the latter in the model's
    band. error: relative error in the band, as measured; noise included."""

    forces: FloatArray
    measured: FloatArray
    error: float


@dataclass(frozen=True, slots=True, eq=False)
class ContactPlay:
    """A transient at a contact: as requested, as predicted by the model, and as played with and without the model.
    normal: (3,), of length 1."""

    plan: ContactPlan
    normal: FloatArray
    sample_rate_hz: float
    band_hz: tuple[float, float]
    reference: FloatArray
    """(N, 3), m/s^2: the part in the model's band, followed by the time to come to rest."""
    start: ContactSolutions
    equalized: PlayedTransient
    single_gain: PlayedTransient
    """The recording played as a force along the normal, with a single gain for all frequencies."""


def play_contact(
    plan: ContactPlan, on_progress: Callable[[float], None], before_moving: BeforeMoving = refuse_unannounced
) -> ContactPlay:
    """Solve, play with and without the model, and write. on_progress: called with the share played, 0 to 1. Raises
    StudyError; for unsuitable input before any motion, and nothing is written then."""
    require_new_folder(plan.out)
    normal = _normalise(plan.normal)
    transient = _read_transient(plan)
    models = read_playback_models((plan.model,), None, plan.weight)
    require_device_alone(models)
    model, rate_hz, band_hz = models.nearest, models.nearest.sample_rate_hz, models.band_hz
    try:
        require_rate(transient, rate_hz)
        recording = plan.scale * transient.signal.samples[:, 0]
        start = prepare_causal_start(make_tracking_problem(model, TrackingWeights(plan.weight)), recording, PADDING)
    except ValueError as error:
        raise _make_play_error(f"{plan.transient.name}: {error}.", "Correct what is named.") from error
    feedforward = start.basis.compute_forces(normal)
    reference = np.outer(np.pad(recording, (0, len(feedforward) - len(recording))), normal)
    gain_inverse = make_static_gain_inverse(model, np.geomspace(*model.band_hz, GAIN_LINES))
    forces = (
        _require_cap(_fade_out(_subtract_spring_force(feedforward, reference, models), rate_hz), plan, rate_hz),
        _require_cap(gain_inverse.response[0, 0, 0].real * reference, plan, rate_hz),
    )
    measured = _play_both(plan, models, forces, on_progress, before_moving)
    in_band = filter_to_band(reference, rate_hz, band_hz)
    equalized, single_gain = (
        PlayedTransient(
            force, filter_to_band(response, rate_hz, band_hz), compute_band_error(reference, response, rate_hz, band_hz)
        )
        for force, response in zip(forces, measured, strict=True)
    )
    play = ContactPlay(plan, normal, rate_hz, band_hz, in_band, start, equalized, single_gain)
    _write_play(play, models)
    return play


def _normalise(normal: Vector) -> FloatArray:
    """Scale the normal (3,) to length 1. Raises WrongUseError for a length of zero or that is not finite."""
    if not 0 < (length := float(np.linalg.norm(normal))) < np.inf:
        normal_text = " ".join(f"{entry:g}" for entry in normal)
        raise WrongUseError("This is no normal", f"--normal is {normal_text}.", "Such as --normal 0 0 1.")
    return np.asarray(normal, dtype=np.float64) / length


def _read_transient(plan: ContactPlan) -> Trajectory:
    """Read the recorded acceleration. Raises WrongUseError for a table of another kind, StudyError if unreadable."""
    table = read_trajectory(plan.transient)
    if table.kind is not TRANSIENT:
        raise WrongUseError(
            "This is no table of a transient",
            f"{plan.transient.name} holds {table.kind.name}; its header must be {','.join(TRANSIENT.header)}.",
            "Give the recorded acceleration along the normal, in m/s^2, from the moment of contact on.",
            saved="Nothing moved.",
        )
    return table


def _subtract_spring_force(forces: FloatArray, reference: FloatArray, models: PlaybackModels) -> FloatArray:
    """Subtract the force that the device's virtual spring adds along the reference motion, (N, 3) in m/s^2."""
    spring, rate_hz = find_acting_spring(models), models.nearest.sample_rate_hz
    return compensate_spring(lambda _: forces, spring, rate_hz, models.band_hz)(reference)


def _fade_out(forces: FloatArray, rate_hz: float) -> FloatArray:
    """Multiply forces (N, 3) by a raised cosine that falls from 1 to 0 over the last FADE_S."""
    remaining_s = np.arange(len(forces))[::-1] / rate_hz
    fade_share = np.clip(remaining_s / FADE_S, 0.0, 1.0)
    return np.asarray(forces * (0.5 - 0.5 * np.cos(np.pi * fade_share))[:, np.newaxis])


def _require_cap(forces: FloatArray, plan: ContactPlan, rate_hz: float) -> FloatArray:
    """Return forces (N, 3), N, unchanged. Raises StudyError; above the cap with the largest --scale that fits."""
    try:
        require_under_cap(forces, plan.cap_n, rate_hz)
    except ForceLimitError as error:
        happened = f"The forces would reach {error.peaks.peak_n:.3g} N, above the cap of {plan.cap_n:g} N."
        scale_text = f"--scale {round_scale_down(plan.scale * error.peaks.largest_scale):g}"
        advice = f"Give {scale_text} or less, or raise --cap for a device that no hand holds."
        raise _make_play_error(happened, advice) from error
    except ValueError as error:
        raise _make_play_error(f"{plan.transient.name}: {error}.", "Correct what is named.") from error
    return forces


def _play_both(
    plan: ContactPlan,
    models: PlaybackModels,
    forces: tuple[FloatArray, FloatArray],
    on_progress: Callable[[float], None],
    before_moving: BeforeMoving,
) -> list[FloatArray]:
    """Play each of the forces on one device and return the accelerations, (N, 3) in m/s^2. Raises StudyError."""
    clock = RealClock() if needs_real_time(plan.device) else VirtualClock()
    settings = _make_settings(plan, models, forces)
    measured: list[FloatArray] = []

    def report_share(share: float) -> None:
        on_progress((len(measured) + share) / len(forces))

    with contextlib.closing(open_device(plan.device, settings, clock, plan.seed)) as device:
        if device.info.sample_rate_hz != models.nearest.sample_rate_hz:
            raise _make_play_error(
                f"The model is at {models.nearest.sample_rate_hz:g} Hz, the device runs at "
                f"{device.info.sample_rate_hz:g} Hz.",
                "Identify a model from recordings of this device.",
            )
        total_s = sum(len(command) / device.info.sample_rate_hz + 2 * SETTLE_S for command in forces)
        try:
            announce_motion(device, plan.cap_n, total_s, before_moving)
            for command in forces:
                measured.append(_play_transient(device, command, report_share))
        except KeyboardInterrupt as interruption:
            if device.fault() is Fault.FORCE_LEFT:
                raise DeviceError("The force may still be on", Fault.FORCE_LEFT.sentence, RESTART, UNSAVED) from None
            explanation = f"{len(measured)} of {len(forces)} plays were measured; the force was released."
            raise UserInterruptError("Interrupted", explanation, RESTART, UNSAVED) from interruption
    return measured


def _make_settings(plan: ContactPlan, models: PlaybackModels, forces: tuple[FloatArray, FloatArray]) -> DeviceSettings:
    """Make the device's settings. The slew limit allows the initial step: forces begin at contact without fade-in."""
    settings, rate_hz = make_playback_settings(plan.cap_n, models), models.nearest.sample_rate_hz
    steps_n = [np.linalg.norm(np.diff(command, axis=0, prepend=0, append=0), axis=1).max() for command in forces]
    slew_n_per_s = max(settings.limits.slew_n_per_s, float(max(steps_n)) * rate_hz + SPRING_SLEW_N_PER_S)
    return replace(settings, limits=replace(settings.limits, slew_n_per_s=slew_n_per_s))


def _play_transient(device: Device, forces: FloatArray, on_progress: Callable[[float], None]) -> FloatArray:
    """Play forces (N, 3), N, and return the measured acceleration, (N, 3) in m/s^2, less its mean at rest before."""
    rest_rows = round(SETTLE_S * device.info.sample_rate_hz)
    padded_forces = np.pad(forces, ((rest_rows, rest_rows), (0, 0)))
    acceleration = read_measured_acceleration(play_forces(device, padded_forces, on_progress))
    return np.asarray(acceleration[rest_rows : rest_rows + len(forces)] - acceleration[:rest_rows].mean(axis=0))


def _write_play(play: ContactPlay, models: PlaybackModels) -> None:  # tables, figure and contact.json in a new folder
    from analysis.figures.contact_transient import make_contact_picture
    from study.workflows.picture_files import write_pictures

    rate_hz = play.sample_rate_hz
    with create_new_folder(play.plan.out) as folder:
        for name, samples, table_kind in (
            ("forces.csv", play.equalized.forces, FORCES),
            ("wanted.csv", play.reference, TRAJECTORY),
            ("measured.csv", play.equalized.measured, TRAJECTORY),
        ):
            signal = Signal(samples, rate_hz, table_kind.quantity, table_kind.unit, table_kind.header[1:])
            write_trajectory(folder / name, Trajectory(signal))
        plays = (  # title, forces, acceleration
            ("through the model", play.equalized.forces, play.equalized.measured),
            ("one gain", play.single_gain.forces, play.single_gain.measured),
        )
        write_pictures(folder, [make_contact_picture(play.normal, rate_hz, play.reference, *plays)])
        provenance = gather_provenance(seeds={"device": play.plan.seed}).as_dict()
        document = {**summarise_contact(play), "model_sha256": models.sha256, "provenance": provenance}
        write_json(folder / "contact.json", "hapteq-contact", 1, document, overwrite=False)


def summarise_contact(play: ContactPlay) -> dict[str, Any]:
    """Collect the values of contact.json and `--json`: relative errors in the band (1 = 100 %), largest force (N)."""
    return {
        "out": str(play.plan.out),
        "normal": play.normal.tolist(),
        "band_hz": list(play.band_hz),
        "predicted_error": play.start.compute_error(play.normal),
        "early_error": play.start.compute_early_error(play.normal),
        "worst_error": play.start.worst_error,
        "measured_error": play.equalized.error,
        "plain_error": play.single_gain.error,
        "peak_n": float(np.linalg.norm(play.equalized.forces, axis=1).max()),
    }


def format_contact(play: ContactPlay) -> tuple[str, ...]:
    """Format lines for the terminal: errors by the model and as measured (%), and the largest force (N)."""
    values = summarise_contact(play)
    low_hz, high_hz = play.band_hz
    return (
        f"By the model: error {_to_percent(values['predicted_error'])} between {low_hz:g} and {high_hz:g} Hz, "
        f"{_to_percent(values['worst_error'])} at most for any normal; {_to_percent(values['early_error'])} if forces "
        "might begin before the contact.",
        f"As measured: error {_to_percent(values['measured_error'])}; as a force along the normal with one gain "
        f"{_to_percent(values['plain_error'])}.",
        f"The highest force is {values['peak_n']:.3g} N.",
    )


def _to_percent(ratio: float) -> str:
    return f"{100 * ratio:.1f} %"


def _make_play_error(explanation: str, advice: str) -> StudyError:
    return StudyError("The transient was not played", explanation, advice, saved="Nothing moved.")
