"""Export the real-time controller of an identified model as C sources (`hapteq export-controller`).

The controller (`equalizer.tracking.realtime`) plays a stored transient in any direction, and tracks a stream of
reference accelerations with a preview. Header, example loop and check program are written into a new folder.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from analysis.wording import capitalise
from equalizer.plant.identified_model import IdentifiedModel
from equalizer.signals.signal import FloatArray
from equalizer.tracking.feedforward.trajectory import TRAJECTORY, TableError, require_rate
from equalizer.tracking.lqr.tracking_problem import TrackingError
from equalizer.tracking.realtime.controller_cases import compute_controller_cases
from equalizer.tracking.realtime.realtime_controller import (
    RealtimeController,
    RealtimeSettings,
    make_realtime_controller,
)
from study.devices.opening import HAND_STIMULUS_CAP_N, LARGEST_DEVICE_FORCE_N
from study.errors import StudyError
from study.store.disk.provenance import compute_sha256
from study.store.disk.text_file import write_text
from study.store.formats.identified_model_file import read_identified_model
from study.store.formats.trajectory_file import read_trajectory
from study.workflows.equalizer.controller.c_source import (
    CHECK_NAME,
    EXAMPLE_NAME,
    HEADER_NAME,
    format_check_program,
    format_header,
    read_example,
)
from study.workflows.output_paths import require_new_outputs

TITLE = "The controller was not exported"
"""Title of the errors that this module raises."""
MAX_TRANSIENT_ROWS = 5000
"""Largest number of rows of a transient. Chosen: for a model of order 26 each row becomes 105 numbers of C source (3 x
26 gains, 3 x 9 feedforward forces), all of which a compiler must read."""
MAX_PREVIEW_S = 2.0
"""Longest preview that is accepted (s). Chosen: each sample of it becomes a matrix of C source."""
EXAMPLE_SETTINGS = "Such as --preview 200 --cap 3."
"""Advice in error messages: settings (ms, N) that fit in most cases."""


@dataclass(frozen=True, slots=True)
class ControllerPlan:
    """Arguments of `export_controller`: file of an identified model, new folder for the sources, and settings."""

    model: Path
    out: Path
    transient: Path | None = None
    """Table of reference accelerations (m/s²); None: that of
    `realtime_controller.make_default_transient`."""
    settings: RealtimeSettings = field(default_factory=RealtimeSettings)


@dataclass(frozen=True, slots=True, eq=False)
class ExportedController:
    """A controller whose C sources were written: header, example loop and check program in the folder `plan.out`."""

    plan: ControllerPlan
    model: IdentifiedModel
    controller: RealtimeController

    @property
    def files(self) -> tuple[Path, ...]:
        """Paths of the header, the example and the check."""
        return tuple(self.plan.out / name for name in (HEADER_NAME, EXAMPLE_NAME, CHECK_NAME))


def export_controller(plan: ControllerPlan) -> ExportedController:
    """Compute the controller and write its sources. Raises StudyError for an output that exists, a cap above the force
    of the strongest supported device, and a model or transient from which no controller can be made; nothing is written
    then."""
    require_new_outputs(plan.out, title=TITLE, kind="controllers")
    if plan.settings.cap_n > LARGEST_DEVICE_FORCE_N:
        raise _make_refusal(
            f"The cap is {plan.settings.cap_n:g} N; the strongest device gives {LARGEST_DEVICE_FORCE_N:g} N.",
            EXAMPLE_SETTINGS,
        )
    model = read_identified_model(plan.model)
    try:
        if model.D.shape != (3, 3) or model.input_unit != "N" or model.output_unit != "m/s^2":
            raise TrackingError("the model is not of three forces (N) and three accelerations (m/s^2)")
        transient = None if plan.transient is None else _read_transient(plan.transient, model)
        controller = make_realtime_controller(model, transient, plan.settings)
        cases = compute_controller_cases(controller)
    except (TrackingError, TableError) as problem:
        raise _make_refusal(
            f"{capitalise(str(problem))}.", "Correct what it says, or choose another model."
        ) from problem
    exported = ExportedController(plan, model, controller)
    sources = (format_header(controller, _describe_origin(plan, model)), read_example(), format_check_program(cases))
    plan.out.mkdir()
    for path, text in zip(exported.files, sources, strict=True):
        write_text(path, text)
    return exported


def make_controller_settings(weight: float, preview_s: float, cap_n: float) -> RealtimeSettings:
    """Make and check the settings of the real-time controller. weight: of |force|² against |error|² in the cost, (m/s²
    per N)²; preview_s: time (s) for which the stream is known in advance; cap_n: largest force (N). Raises StudyError
    for a preview or a force outside its limits; `export_controller` checks the weight."""
    if not preview_s <= MAX_PREVIEW_S:
        raise _make_refusal(
            f"A preview of {preview_s:g} s was requested; {MAX_PREVIEW_S:g} s is the longest.", EXAMPLE_SETTINGS
        )
    try:
        return RealtimeSettings(weight, preview_s, cap_n)
    except TrackingError as problem:
        raise _make_refusal(f"{capitalise(str(problem))}.", EXAMPLE_SETTINGS) from problem


def summarise_export(exported: ExportedController) -> dict[str, Any]:
    """Collect the results as plain values for a JSON document, units by the suffix of the key. Errors are tracking
    errors relative to the reference (1 = 100 %), as predicted by the model itself."""
    controller, rate_hz = exported.controller, exported.model.sample_rate_hz
    return {
        "files": [str(path) for path in exported.files],
        "sample_rate_hz": rate_hz,
        "band_hz": list(exported.model.band_hz),
        "states": controller.problem.order,
        "transient_rows": len(controller.transient),
        "preview_samples": len(controller.tracker),
        "stream_late_s": (len(controller.tracker) - 1) / rate_hz,
        "stream_error": controller.loss.error,
        "stream_error_without_limit": controller.loss.full_error,
        "cap_n": controller.cap_n,
    }


def warn_of_export(exported: ExportedController) -> tuple[str, ...]:
    """Return a warning if the controller's cap is above the largest force that hapteq plays with a hand on the handle;
    an empty tuple otherwise."""
    cap_n = exported.controller.cap_n
    if cap_n <= HAND_STIMULUS_CAP_N:
        return ()
    return (
        f"Its cap of {cap_n:g} N is above the {HAND_STIMULUS_CAP_N:g} N that hapteq plays with a hand on the handle, "
        "and the exported code contains no safety layer: docs/controller.md.",
    )


def describe_export(exported: ExportedController) -> tuple[str, ...]:
    """Format lines for the terminal: files, length of the transient, delay and predicted error of the stream, and the
    command that compiles and runs the check."""
    values, (low_hz, high_hz) = summarise_export(exported), exported.model.band_hz
    return (
        *values["files"],
        f"Transient: {values['transient_rows']} rows with their room to come to rest, turned by any rotation.",
        f"Stream: {1000 * values['stream_late_s']:.0f} ms late; as the model itself predicts, error "
        f"{100 * values['stream_error']:.2g} % from {low_hz:g} to {high_hz:g} Hz "
        f"({100 * values['stream_error_without_limit']:.2g} % with all of it known), and what the bands' overlap adds.",
        f"Check it where it shall run: cc -std=c11 -O2 {CHECK_NAME} -o check -lm && ./check",
    )


def _read_transient(path: Path, model: IdentifiedModel) -> FloatArray:
    """Read the transient (N, 3), m/s², of a table. Raises TableError for another kind of table, another sample rate
    than the model's, or too many rows."""
    table = read_trajectory(path)
    if table.kind is not TRAJECTORY:
        header, expected_header = ",".join(table.kind.header), ",".join(TRAJECTORY.header)
        raise TableError((f"the table {path.name} has the header {header}; it must be {expected_header}",))
    require_rate(table, model.sample_rate_hz)
    if len(table.signal) > MAX_TRANSIENT_ROWS:
        raise TableError(
            (f"the table {path.name} has {len(table.signal)} rows; a controller takes {MAX_TRANSIENT_ROWS}",)
        )
    return table.signal.samples


def _describe_origin(plan: ControllerPlan, model: IdentifiedModel) -> tuple[str, ...]:
    """Format lines for the header: model file, band, position in the workspace, channels, transient and weight."""
    low_hz, high_hz = model.band_hz
    transient_text = "a tap along the last axis, 1 m/s^2" if plan.transient is None else plan.transient.name
    place_text = (
        "" if model.place_m is None else f", at {', '.join(f'{coordinate_m:g}' for coordinate_m in model.place_m)} m"
    )
    return (
        f"Of {plan.model.name} (SHA-256 {compute_sha256(plan.model)[:16]}), {low_hz:g} to {high_hz:g} Hz{place_text}.",
        f"Forces {', '.join(model.input_channels)} in N; accelerations {', '.join(model.output_channels)} in m/s^2.",
        f"The transient: {transient_text}. Weight {plan.settings.weight:g}.",
    )


def _make_refusal(explanation: str, advice: str) -> StudyError:
    """Make the error of this command, which wrote nothing."""
    return StudyError(TITLE, explanation, advice, saved="Nothing was written.")
