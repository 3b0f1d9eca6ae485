"""The labels of a bank, opened once its cases are answered: seals are checked, and both become outcomes."""

from collections.abc import Iterable
from typing import Any

from analysis.diagnosis.document import diagnosis_from_json
from analysis.evaluation.proof.outcome import Concealed, Outcome
from study.evaluation.bank.proof_folder import ANSWER, ProofFolder
from study.evaluation.bank.proof_seals import answer_at, broken_seal, is_of, label_at, seals_of
from study.store.disk.provenance import sha256_of


def reveal_cases(folder: ProofFolder, cases: int) -> tuple[Outcome, ...]:
    """Of the first so many numbers, all that are answered. Raises StudyError where a seal is broken."""
    seals = seals_of(folder)
    found, broken = [], []
    for path in sorted(folder.sealed.glob("*.json")):
        if seals.get(f"sealed/{path.name}") != sha256_of(path):
            broken.append(path.name)
            continue
        label = label_at(path)
        place = folder.open / label["name"]
        if label["number"] >= cases or not (place / ANSWER).exists():
            continue
        said = answer_at(place)
        if not is_of(label, said):
            broken.append(path.name)
        found.append(outcome_of(label, said))
    if broken:
        raise broken_seal(broken, folder.path)
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


def engines(folder: ProofFolder, names: Iterable[str]) -> tuple[str, ...]:
    """Digests of the code that gave the answers; more than one where it changed on the way."""
    answers = [answer_at(folder.open / name) for name in names if (folder.open / name / ANSWER).exists()]
    return tuple(sorted({one["engine"] for one in answers if "engine" in one}))
