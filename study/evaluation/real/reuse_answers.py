"""Reuse answers of an earlier run: kept if inputs and settings are unchanged, refused before any work otherwise."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from analysis.diagnosis.real_answer.real_answer import RealAnswer
from study.errors import StudyError
from study.evaluation.real.real_folder import RealRecording
from study.store.disk.provenance import Provenance, gather_provenance
from study.store.formats.real_answer_file import read_answer_and_origin

ANSWER_NAME, INJECTED_NAME = "answer.json", "injected"


@dataclass(frozen=True, slots=True)
class _EarlierAnswer:
    place: Path
    answer: RealAnswer
    changes: tuple[str, ...]
    """What differs from when it was made."""


def answer_place(out: Path, real_recording: RealRecording) -> Path:
    """Folder with the results of one recording."""
    return out / real_recording.folder.name / real_recording.name


def origin_of_answer(real_recording: RealRecording, seconds: float | None) -> Provenance:
    """Provenance: all inputs on which an answer depends. Raises CannotReadError."""
    files = tuple(dict.fromkeys((*real_recording.parents, *real_recording.tested_on)))
    return gather_provenance(parents=files, settings={"seconds": seconds})


def reusable_answers(out: Path, wanted: Sequence[RealRecording], seconds: float | None) -> dict[Path, RealAnswer]:
    """Earlier answers by folder; nothing is written. Raises StudyError where one is damaged or was made from other
    inputs."""
    there = [each for each in wanted if (answer_place(out, each) / ANSWER_NAME).is_file()]
    kept = [_read_earlier_answer(answer_place(out, each), each, seconds) for each in there]
    if outdated := [each for each in kept if each.changes]:
        raise _inputs_changed_error(out, outdated)
    return {each.place: each.answer for each in kept}


def _read_earlier_answer(place: Path, real_recording: RealRecording, seconds: float | None) -> _EarlierAnswer:
    try:
        answer, origin = read_answer_and_origin(place / ANSWER_NAME)
    except StudyError as error:
        raise StudyError(
            f"{real_recording.folder.name}/{real_recording.name}/{error.title}",
            error.happened,
            f"Move {place} away to have it answered anew, or choose another --out.",
            saved="Nothing was written.",
        ) from error
    now = origin_of_answer(real_recording, seconds)
    files = {(parent.file, parent.sha256) for parent in now.parents}
    return _EarlierAnswer(place, answer, (*_file_changes(_files_in(origin), files), *_setting_changes(origin, seconds)))


def _files_in(origin: Mapping[str, Any]) -> set[tuple[str, str]]:
    stored = origin.get("parents")
    parents = stored if isinstance(stored, list) else []
    return {(str(parent.get("file")), str(parent.get("sha256"))) for parent in parents if isinstance(parent, dict)}


def _file_changes(then: set[tuple[str, str]], now: set[tuple[str, str]]) -> Iterator[str]:
    names_then, names_now = ({name for name, _ in files} for files in (then, now))
    for name in sorted({name for name, _ in then ^ now}):
        if name not in names_then:
            yield f"{name} is not among what it says it was made from"
        else:
            yield f"{name} has changed" if name in names_now else f"{name} is gone"


def _setting_changes(origin: Mapping[str, Any], seconds: float | None) -> Iterator[str]:
    settings = origin.get("settings")
    then = settings.get("seconds", "") if isinstance(settings, dict) else ""
    if not isinstance(then, int | float | None):
        yield "it does not say its --seconds"
    elif then != seconds:
        yield f"--seconds was {_seconds(then)}, and is {_seconds(seconds)}"


def _seconds(limit_s: float | None) -> str:
    return "left out" if limit_s is None else f"{limit_s:g}"


def _inputs_changed_error(out: Path, outdated: Sequence[_EarlierAnswer]) -> StudyError:
    texts = (f"{each.place.relative_to(out) / ANSWER_NAME}: {', '.join(each.changes)}." for each in outdated)
    places = [str(each.place) for each in outdated]
    if (injected := out / INJECTED_NAME).exists():
        places.append(f"{injected}, which was made with them")
    return StudyError(
        "Answers that are there were made from something else",
        " ".join(texts),
        f"Choose another --out; or, to have them answered anew, move away {'; '.join(places)}.",
        saved="The old answers are kept as they are, and nothing was written.",
    )
