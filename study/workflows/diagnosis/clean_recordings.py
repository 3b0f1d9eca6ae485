"""Reads clean recordings (`--clean`), made when the device was intact, as the reference for those to be diagnosed.

Both must have the same channels, units and rate; the same recording cannot serve as both.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from analysis.diagnosis.data.input_checks import NothingToDiagnose, require_alike
from analysis.diagnosis.prepare_recordings import keep_common_signals
from study.errors import StudyError
from study.workflows.diagnosis.diagnosis_input import DiagnosisInput, not_diagnosable_error, read_input

NOT_ALIKE = "Give clean recordings of the same device, with the same channels, units and rate, or leave --clean out."
"""Advice where the two sets of recordings differ."""


@dataclass(frozen=True, slots=True, eq=False)
class InputWithReference:
    """Input of a diagnosis and its clean reference. Positions and conditions that only some recordings have are
    removed."""

    found: DiagnosisInput
    clean: DiagnosisInput


def with_clean(found: DiagnosisInput, sources: Sequence[Path], clean: Sequence[Path], seed: int) -> InputWithReference:
    """Read the reference and reduce both inputs to their common signals. sources: files of `found`; clean: reference
    recordings, or the folder of a session; seed: see `read_input`. Raises StudyError where a file is in both, or
    channels, units or rates differ."""
    known = {source.resolve() for source in sources}
    if (both := next((path for path in clean if path.resolve() in known), None)) is not None:
        raise StudyError(
            f"{both} cannot be diagnosed and be clean at the same time",
            "Its differences from the model would be learned as those of a device in order, so that none would be "
            "found.",
            "Give another recording with --clean, of the device when it was in order.",
            saved="Nothing was written.",
        )
    beside = read_input(clean, seed, constants=found.constants)
    try:
        require_alike(
            (found.recordings[0], *beside.recordings),
            (found.names[0] if found.names else "the recording", *beside.names),
            "one says nothing of the other",
        )
    except NothingToDiagnose as refusal:
        raise not_diagnosable_error(refusal.problems, NOT_ALIKE) from refusal
    number = len(found.recordings)
    every = keep_common_signals((*found.recordings, *beside.recordings))
    return InputWithReference(
        replace(found, recordings=every.recordings[:number], remarks=(*found.remarks, *every.remarks)),
        replace(beside, recordings=every.recordings[number:]),
    )
