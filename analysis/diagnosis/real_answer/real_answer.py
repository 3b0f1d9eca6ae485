"""The diagnosis of one real recording as plain values: a row of a table, a section of a page."""

import json
from dataclasses import asdict
from typing import Any, Literal

from pydantic import ConfigDict, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from analysis.diagnosis.document import Candidate, Errors
from equalizer.signals.listed_problems import ListedProblemsError

FORMAT, VERSION = "hapteq-real-answer", 1
STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)

Outcome = Literal["no_mismatch", "parameters", "explained", "partly_explained", "unexplained", "refused"]


class RealAnswerError(ListedProblemsError):
    """A document that is no such answer. `problems`: one sentence each."""


@dataclass(frozen=True, config=STRICT)
class HeldOutStretch:
    """One channel over one stretch that nothing was fitted to; root-mean-squares in `unit`."""

    record: str
    channel: str
    unit: str
    start_s: float
    stop_s: float
    signal: float
    retuned: float
    after: float


@dataclass(frozen=True, config=STRICT)
class OwnParameter:
    """A number of the simple model after everything, with its 95 % interval, and what is known by other means."""

    name: str
    unit: str
    value: float
    low: float | None
    high: float | None
    nominal: float | None
    """The value known by other means; None = not known."""

    @property
    def holds_nominal(self) -> bool | None:
        """Whether the interval contains the nominal value; None where either is not known."""
        if self.nominal is None or self.low is None or self.high is None:
            return None
        return self.low <= self.nominal <= self.high


@dataclass(frozen=True, config=STRICT)
class FurtherTest:
    """Another recording of the device, predicted with what was found and nothing fitted; shares of the signal."""

    recording: str
    title: str
    error: str
    retuned: float | None
    after: float | None
    stretches: tuple[HeldOutStretch, ...] = ()
    """The whole of each channel, where what was compared are the responses."""
    problem: str = ""


@dataclass(frozen=True, config=STRICT)
class PairOutcome:
    """Before and after something was changed. Errors on the held-out part of the recording from after."""

    changed: str
    before: str
    after: str
    verdict: Outcome
    named: tuple[str, ...]
    """Effects, each as a reader calls it with its parameters."""
    returned: tuple[str, ...]
    """Names of the vocabulary: what was named, and what these data cannot tell from it."""
    as_before: float | None
    """Error of the model from before, unchanged."""
    gain: float | None
    """Error with one gain factor re-tuned."""
    retuned: float | None
    """Error re-tuned within its tolerances."""
    with_effects: float | None
    """Error with the named effects."""
    expected_left: float | None
    """Error of the model on the recording from before."""


@dataclass(frozen=True, config=STRICT)
class DrawnExcerpt:
    """A held-out stretch that shows the effects found."""

    record: str
    channel: str
    unit: str
    start_s: float
    step_s: float
    measured: tuple[float, ...]
    retuned: tuple[float, ...]
    after: tuple[float, ...]


@dataclass(frozen=True, config=STRICT)
class RealAnswer:
    """One recording. Errors are shares of the signal."""

    folder: str
    recording: str
    title: str
    device: str
    verdict: Outcome
    answer: str
    """The verdict as a sentence; where the recording was refused, why."""
    model: str
    """The simple model, in words."""
    error: str
    """How errors were measured; empty where nothing was."""
    fitted: Errors | None
    held_out: Errors | None
    black_box: float | None
    where: tuple[str, ...]
    named: tuple[str, ...]
    effects: tuple[str, ...]
    """Names of the vocabulary."""
    left: str
    """What is still unexplained, in a sentence."""
    remarks: tuple[str, ...]
    numbers: tuple[OwnParameter, ...]
    stretches: tuple[HeldOutStretch, ...]
    excerpt: DrawnExcerpt | None
    further: tuple[FurtherTest, ...]
    pair: PairOutcome | None
    objections: tuple[str, ...]
    seconds: float
    candidates: tuple[Candidate, ...] = ()
    """The best that were not confirmed, the first first;"""
    not_confirmed: tuple[str, ...] = ()
    """each as a sentence with its parameters, but for one that `answer` says."""


def real_answer_to_json(answer: RealAnswer) -> dict[str, Any]:
    """Plain values, without format and version."""
    return asdict(answer)


def real_answer_from_json(document: dict[str, Any]) -> RealAnswer:
    """Parse the document of an answer. document: without format and version. Raises RealAnswerError."""
    try:
        return _ADAPTER.validate_json(json.dumps(document), strict=True)
    except ValidationError as error:
        wrong = tuple(f"{'.'.join(map(str, problem['loc']))}: {problem['msg']}" for problem in error.errors())
        raise RealAnswerError(wrong) from error


def real_answer_schema() -> dict[str, Any]:
    """JSON Schema of what `real_answer_to_json` gives."""
    return _ADAPTER.json_schema(mode="serialization")


_ADAPTER: TypeAdapter[RealAnswer] = TypeAdapter(RealAnswer)
