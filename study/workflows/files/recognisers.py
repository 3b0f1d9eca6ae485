"""Recognisers of hapteq's own file formats, one function per format (`hapteq validate`).

A recogniser identifies a format by its format attribute or entry, its top-level keys or its header, then reads the
whole file with the reader of that format and returns a description in words. A new format adds its function to
`RECOGNISERS`.
"""

from collections.abc import Callable

from analysis.diagnosis.document import FORMAT as DIAGNOSIS_FORMAT
from analysis.diagnosis.real_answer.real_answer import FORMAT as REAL_ANSWER_FORMAT
from analysis.evaluation.reproduction.document import FORMAT as REPRODUCTION_FORMAT
from analysis.look.driven_band import find_silent_segments
from equalizer.plant.model_quality import write_quality_brief
from equalizer.signals.recording import Recording
from equalizer.signals.units import NO_UNIT, UnknownUnitError, check_quantity, parse_unit
from equalizer.tracking.feedforward.trajectory import TABLE_KINDS, TRAJECTORY
from protocols.definition.recording_protocol import RecordingProtocol
from protocols.document.loading import ProtocolError
from protocols.document.schema import ADAPTERS, make_protocol_schema
from protocols.wording.english import ENGLISH
from study.importing.map_format.import_map import ChannelMap, ComputedMap
from study.importing.map_format.map_toml import KIND as MAP_KIND
from study.importing.map_format.map_toml import is_map, parse_map
from study.session.views.count_text import format_count
from study.store.disk.csv_rows import find_header_problem
from study.store.disk.file_errors import UnusableFileError
from study.store.formats import calibration_file, identified_model_file, recording_layout
from study.store.formats.calibration_file import read_calibration
from study.store.formats.daily_check_file import FORMAT as DAILY_CHECK_FORMAT
from study.store.formats.daily_check_file import read_daily_check
from study.store.formats.diagnosis_file import read_diagnosis
from study.store.formats.identified_model_file import read_identified_model
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.store.formats.participant_texts import load_in_language, read_language
from study.store.formats.protocol_files import find_locked_words
from study.store.formats.real_answer_file import read_real_answer
from study.store.formats.recording_file import read_recording
from study.store.formats.repeats_file import FORMAT as REPEATS_FORMAT
from study.store.formats.repeats_file import read_repeats
from study.store.formats.reproduction_file import read_reproduction
from study.store.formats.thresholds_file import DETECTION_NAME, THRESHOLDS_HEADER, read_thresholds
from study.store.formats.trajectory_file import read_trajectory
from study.store.formats.trials_file import TRIALS_HEADER, read_trials
from study.workflows.files.file_content import FileContent

Recogniser = Callable[[FileContent], str | None]
"""Function that returns the kind of a file in words, or None if the file has another format. Raises UnusableFileError
if the file has this format but its content is wrong."""


def recognise_recording(content: FileContent) -> str | None:
    """Recognise an HDF5 recording by its format attribute. Raises UnusableFileError also for segments that
    `find_silent_segments` reports."""
    if content.hdf5_format != recording_layout.FORMAT:
        return None
    recording = read_recording(content.path)
    if silence_problems := find_silent_segments(recording):
        raise UnusableFileError(content.path, recording_layout.KIND, silence_problems)
    return f"recording, {describe_recording(recording)}"


def describe_recording(recording: Recording) -> str:
    """Describe duration, sample rate, and the numbers of channels and segments of a recording."""
    parts = [
        f"{recording.response.duration_s:g} s at {recording.sample_rate_hz:g} Hz",
        format_count(len(recording.command.channels), "command"),
        format_count(len(recording.response.channels), "response"),
    ]
    if recording.position is not None:
        parts.append(format_count(len(recording.position.channels), "position"))
    if recording.condition is not None:
        parts.append(format_count(len(recording.condition.channels), "condition"))
    if recording.segments:
        parts.append(format_count(len(recording.segments), "segment"))
    return ", ".join(parts)


def recognise_identified_model(content: FileContent) -> str | None:
    """Recognise an identified model in HDF5 by its format attribute."""
    if content.hdf5_format != identified_model_file.FORMAT:
        return None
    model = read_identified_model(content.path)
    stability_text = (
        "stable" if model.spectral_radius < 1 else f"unstable (spectral radius {model.spectral_radius:.6g})"
    )
    return (
        f"identified model of order {model.order}, {model.band_hz[0]:g} to {model.band_hz[1]:g} Hz at "
        f"{model.sample_rate_hz:g} Hz, {format_count(len(model.input_channels), 'input')}, "
        f"{format_count(len(model.output_channels), 'output')}, {stability_text}, {write_quality_brief(model.quality)}"
    )


def recognise_calibration(content: FileContent) -> str | None:
    """Recognise a calibration of a linkage in HDF5 by its format attribute."""
    if content.hdf5_format != calibration_file.FORMAT:
        return None
    calibration = read_calibration(content.path)
    return (
        f"calibration of the linkage of {calibration.device}, "
        f"{format_count(len(calibration.position_m), 'position')}, {int(calibration.filled.sum())} of them filled in, "
        f"mirrored inertia within {calibration.asymmetry.max():.1%}"
    )


def recognise_mechanical_model(content: FileContent) -> str | None:
    """Recognise a mechanical model in TOML by any of its top-level keys except provenance."""
    if content.toml is None or not content.toml.keys() & {"model", "sensor", "actuator", "effect", "tolerance"}:
        return None
    model = read_mechanical_model(content.path)
    effects_text = ", ".join(effect.kind for effect in model.effects) or "no effects"
    return (
        f"mechanical model '{model.name}', {format_count(model.coordinates, 'coordinate')}, "
        f"{format_count(model.inputs, 'input')}, {format_count(model.outputs, 'output')} ({model.quantity}), "
        f"{effects_text}"
    )


def recognise_import_map(content: FileContent) -> str | None:
    """Recognise an import map in TOML by its list of channels. Raises UnusableFileError also for unknown units."""
    if content.toml is None or not is_map(content.toml):
        return None
    import_map = parse_map(content.text or "", content.path)
    channels: list[ChannelMap | ComputedMap] = [*import_map.channel, *import_map.computed]
    if problems := tuple(problem for channel in channels if (problem := _find_unit_problem(channel))):
        raise UnusableFileError(content.path, MAP_KIND, problems)
    return (
        f"import map for {import_map.device}: {format_count(len(channels), 'channel')}, "
        f"{format_count(len(import_map.clock), 'clock')}"
    )


def _find_unit_problem(channel: ChannelMap | ComputedMap) -> str:
    """Find the problem with a channel's unit; empty if the unit fits the quantity, or is not stated."""
    try:
        check_quantity(channel.quantity, parse_unit(channel.unit.strip() or NO_UNIT))
    except UnknownUnitError as error:
        return f"{channel.role} '{channel.name}': {error}"
    return ""


_PROTOCOL_KEYS = {key for kind in ADAPTERS for key in make_protocol_schema(kind)["properties"]}
"""Top-level keys of all kinds of protocols: a TOML file with any of them is taken for a protocol, unless an earlier
recogniser accepts it."""


def recognise_protocol(content: FileContent) -> str | None:
    """Recognise a study or recording protocol in TOML by any of its top-level keys."""
    if not (content.toml or {}).keys() & _PROTOCOL_KEYS:
        return None
    text, folder = content.text or "", content.path.parent
    try:
        protocol, _ = load_in_language(text, content.path.name, folder, find_locked_words(text, (folder,)))
    except ProtocolError as error:
        raise UnusableFileError(content.path, "protocol", tuple(str(problem) for problem in error.problems)) from error
    kind = "recording" if isinstance(protocol, RecordingProtocol) else "study"
    return f"{kind} protocol '{protocol.name}': {protocol.title}"


def recognise_texts(content: FileContent) -> str | None:
    """Recognise a table of texts for participants, such as a translation, in TOML by any of its keys. Raises
    UnusableFileError also for texts that are missing."""
    if not (content.toml or {}).keys() & ENGLISH.keys():
        return None
    _, table = read_language(str(content.path.absolute()))
    return f"table of texts for participants, {format_count(len(table), 'text')}"


def recognise_diagnosis(content: FileContent) -> str | None:
    """Recognise a diagnosis in JSON by its `format` entry."""
    if content.json_format != DIAGNOSIS_FORMAT:
        return None
    diagnosis = read_diagnosis(content.path)
    return f"diagnosis, {diagnosis.verdict}: {', '.join(effect.effect for effect in diagnosis.effects) or 'no effects'}"


def recognise_daily_check(content: FileContent) -> str | None:
    """Recognise a daily check of a device in JSON by its `format` entry."""
    if content.json_format != DAILY_CHECK_FORMAT:
        return None
    check = read_daily_check(content.path)
    outcome = "passed" if check.passed else "measured too inaccurately to detect a change"
    if not check.changes:
        outcome = "it broke off"
    elif any(change.get("changed") for change in check.changes):
        outcome = "something changed"
    return f"daily check of {check.device} at {check.utc}: {outcome}"


def recognise_repeats(content: FileContent) -> str | None:
    """Recognise the JSON document that accompanies a table of forces from repeated playback, by its `format` entry."""
    if content.json_format != REPEATS_FORMAT:
        return None
    repeats = read_repeats(content.path)
    return (
        f"repeats, {format_count(len(repeats.errors), 'play')}, error {repeats.errors[0]:.2%} to "
        f"{repeats.errors[repeats.kept]:.2%}, noise {repeats.noise_floor:.2%}"
    )


def recognise_real_answer(content: FileContent) -> str | None:
    """Recognise the diagnosis of a real recording in JSON by its `format` entry."""
    if content.json_format != REAL_ANSWER_FORMAT:
        return None
    answer = read_real_answer(content.path)
    return f"answer to the real recording {answer.recording} of {answer.folder}: {answer.verdict.replace('_', ' ')}"


def recognise_reproduction(content: FileContent) -> str | None:
    """Recognise a reproduction of the published values in JSON by its `format` entry."""
    if content.json_format != REPRODUCTION_FORMAT:
        return None
    reproduction = read_reproduction(content.path)
    return (
        f"reproduction of {format_count(len(reproduction.figures), 'figure')} on the {reproduction.device}, "
        f"seed {reproduction.seed}"
    )


def recognise_trajectory(content: FileContent) -> str | None:
    """Recognise a CSV table of a trajectory, forces or a transient by the first column of its header and any other."""
    # A table of another program may begin with the same time.
    if content.header[:1] != TRAJECTORY.header[:1] or not set(content.header[1:]) & _TRAJECTORY_COLUMNS:
        return None
    trajectory = read_trajectory(content.path)
    signal = trajectory.signal
    return f"{trajectory.kind.name}, {signal.duration_s:g} s at {signal.sample_rate_hz:g} Hz ({trajectory.kind.unit})"


_TRAJECTORY_COLUMNS = {name for kind in TABLE_KINDS for name in kind.header[1:]}
"""Names of the columns after the time of all tables of trajectories and forces."""


def recognise_trials(content: FileContent) -> str | None:
    """Recognise a CSV table of trials by its header."""
    # Two matching columns suffice, so that `read_trials` reports an error in another one; one does not, because tables
    # of thresholds also begin with the subject.
    if content.header[:2] != TRIALS_HEADER[:2] and find_header_problem(content.header, TRIALS_HEADER):
        return None
    return f"table of {format_count(len(read_trials(content.path)), 'trial')}"


def recognise_thresholds(content: FileContent) -> str | None:
    """Recognise a CSV table of thresholds by its header, as `recognise_trials` does."""
    if content.header[:2] != THRESHOLDS_HEADER[:2] and find_header_problem(content.header, THRESHOLDS_HEADER):
        return None
    noun = "detection threshold" if content.path.name == DETECTION_NAME else "threshold"
    return f"table of {format_count(len(read_thresholds(content.path)), noun)}"


RECOGNISERS: tuple[Recogniser, ...] = (
    recognise_recording,
    recognise_identified_model,
    recognise_calibration,
    recognise_mechanical_model,
    recognise_diagnosis,
    recognise_real_answer,
    recognise_reproduction,
    recognise_repeats,
    recognise_daily_check,
    recognise_trajectory,
    recognise_trials,
    recognise_thresholds,
    recognise_import_map,
    recognise_protocol,
    recognise_texts,
)
"""Recognisers in the order in which they are tried; the first that returns a kind decides."""
