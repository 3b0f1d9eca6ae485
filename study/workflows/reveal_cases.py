"""The labels of a bank, opened once its cases are answered: seals are checked, and both become outcomes."""

import json
from pathlib import Path
from typing import Any

from analysis.diagnosis.document import diagnosis_from_json
from analysis.proof.outcome import Concealed, Outcome
from study.errors import StudyError
from study.store.provenance import sha256_of
from study.store.text_file import read_text
from study.workflows.proof_folder import ANSWER, ProofFolder


def reveal_cases(folder: ProofFolder, cases: int) -> tuple[Outcome, ...]:
    """Of the first so many numbers, all that are answered. Raises StudyError where a seal is broken."""
    lines = [line.split() for line in read_text(folder.seals).splitlines()]
    seals = {name: digest for digest, name in lines}
    found, broken = [], []
    for path in sorted(folder.sealed.glob("*.json")):
        label = json.loads(read_text(path))
        answer = folder.open / label["name"] / ANSWER
        if label["number"] >= cases or not answer.exists():
            continue
        said = json.loads(read_text(answer))
        if seals.get(f"sealed/{path.name}") != sha256_of(path) or not _same_files(label, said):
            broken.append(path.name)
        found.append(outcome_of(label, said))
    if broken:
        raise _broken(broken, folder.path)
    return tuple(found)


def outcome_of(label: dict[str, Any], said: dict[str, Any]) -> Outcome:
    concealed = tuple(
        Concealed(one["effect"], one["place"], one["axis"], {**one["values"], **one["unseen"]})
        for one in label["truth"]
    )
    return Outcome(
        number=label["number"],
        seed=label["seed"],
        kind=label["kind"],
        bank=label["bank"],
        axes=tuple(label["axes"]),
        model=label["concealed"],
        concealed=concealed,
        strengths=tuple(label["strengths"]),
        adds=label["adds"],
        said=None if "failed" in said else diagnosis_from_json(said["diagnosis"]),
        channel_errors=said.get("channel_errors", {}),
        seconds=said.get("cpu_seconds", float("nan")),
    )


def engines(folder: ProofFolder, names: set[str]) -> tuple[str, ...]:
    """Digests of the code that gave the answers; more than one where it changed on the way."""
    answers = [folder.open / name / ANSWER for name in names]
    found = {json.loads(read_text(path)).get("engine", "died") for path in answers if path.exists()}
    return tuple(sorted(found))


def _same_files(label: dict[str, Any], said: dict[str, Any]) -> bool:
    """A process that died read nothing that it could tell of."""
    keys = ("recording_sha256", "model_sha256")
    return said.get("knows_the_challenge", False) is False and all(
        said.get(key, label[key]) == label[key] for key in keys
    )


def _broken(names: list[str], path: Path) -> StudyError:
    return StudyError(
        "A seal is broken",
        f"Of {len(names)} cases ({', '.join(names[:5])}) in {path} the label, the recording or the model is not what "
        "was sealed before the diagnosis.",
        "Run the bank again in another folder; this one proves nothing.",
        saved="Nothing was changed.",
    )
