"""Read clean recordings (`--clean`), made when the device was intact, as the reference for those to be diagnosed.

Both must have the same channels of command and response, units and rate; the same file cannot be both.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from analysis.diagnosis.data.input_checks import NothingToDiagnoseError, require_comparable
from analysis.diagnosis.prepare_recordings import keep_common_signals
from study.errors import StudyError
from study.workflows.diagnosis.diagnosis_input import DiagnosisInput, make_not_diagnosable_error, read_input

INCOMPARABLE_ADVICE = (
    "Give clean recordings of the same device, with the same channels, units and rate, or leave --clean out."
)
"""Remedy in the message where channels, units or rates of the two sets differ."""


@dataclass(frozen=True, slots=True, eq=False)
class InputWithReference:
    """Input of a diagnosis and its clean reference. Positions, or conditions, whose channels or units differ between
    recordings are removed, with a remark in `diagnosed`."""

    diagnosed: DiagnosisInput
    clean: DiagnosisInput


def read_clean_reference(
    diagnosis_input: DiagnosisInput, sources: Sequence[Path], clean_paths: Sequence[Path], seed: int
) -> InputWithReference:
    """Read the reference and reduce both inputs to their common signals. sources: files of `diagnosis_input`.
    clean_paths: reference recordings, or the folder of a session. seed: for the choice among a session's trials
    (`read_input`). Raises StudyError where a file is in both, cannot be read, or channels, units or rates differ."""
    diagnosed_paths = {source.resolve() for source in sources}
    if (shared_path := next((path for path in clean_paths if path.resolve() in diagnosed_paths), None)) is not None:
        raise StudyError(
            f"{shared_path} cannot be diagnosed and be clean at the same time",
            "Its differences from the model would be learned as those of a device in order, so that none would be "
            "found.",
            "Give another recording with --clean, of the device when it was in order.",
            saved="Nothing was written.",
        )
    clean_input = read_input(clean_paths, seed, constants=diagnosis_input.constants)
    try:
        require_comparable(
            (*diagnosis_input.recordings, *clean_input.recordings),
            (*diagnosis_input.names, *clean_input.names),
            "one says nothing of the other",
        )
    except NothingToDiagnoseError as refusal:
        raise make_not_diagnosable_error(refusal.problems, INCOMPARABLE_ADVICE) from refusal
    diagnosed_count = len(diagnosis_input.recordings)
    common_signals = keep_common_signals((*diagnosis_input.recordings, *clean_input.recordings))
    return InputWithReference(
        replace(
            diagnosis_input,
            recordings=common_signals.recordings[:diagnosed_count],
            remarks=(*diagnosis_input.remarks, *common_signals.remarks),
        ),
        replace(clean_input, recordings=common_signals.recordings[diagnosed_count:]),
    )
