"""Document of the diagnosis of one real recording, format `hapteq-real-answer`, version 1: the values of a row of the
table of real recordings, and of its section in the report. Field names are those of the file and therefore fixed."""

import json
from dataclasses import asdict
from typing import Any, Literal

from pydantic import ConfigDict, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from analysis.diagnosis.document import Candidate, Errors
from equalizer.signals.listed_problems import ListedProblemsError, format_validation_problems

FORMAT, VERSION = "hapteq-real-answer", 1
STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)
"""Validation of all classes of the document: unknown fields, infinite numbers and NaN are refused."""

Outcome = Literal["no_mismatch", "parameters", "explained", "partly_explained", "unexplained", "refused"]
"""Verdict of the diagnosis as in `diagnosis.json`, or "refused" for an unsuitable recording."""


class RealAnswerError(ListedProblemsError):
    """The document is not in this format. `problems`: one sentence each."""


@dataclass(frozen=True, config=STRICT)
class HeldOutStretch:
    """One channel over one stretch that was not used in a fit; root mean squares in `unit`."""

    record: str
    channel: str
    unit: str
    start_s: float
    stop_s: float
    signal: float
    """Rms of the signal about its mean."""
    retuned: float
    """Rms error of the re-tuned model."""
    after: float
    """Rms error of the model with the named effects."""


@dataclass(frozen=True, config=STRICT)
class OwnParameter:
    """A parameter of the simple model after all fits, with its 95 % interval, and the value known by other means."""

    name: str
    unit: str
    value: float
    low: float | None
    """Lower end of the 95 % interval; None = not known."""
    high: float | None
    """Upper end of the 95 % interval; None = not known."""
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
    """Another recording of the device, predicted with the result and without a fit; errors are shares of the signal."""

    recording: str
    title: str
    error: str
    """Name of the error measure."""
    retuned: float | None
    """Error of the re-tuned model; None = not computed."""
    after: float | None
    """Error of the model with the named effects; None = not computed."""
    stretches: tuple[HeldOutStretch, ...] = ()
    """The whole recording of each channel, where responses were compared."""
    problem: str = ""
    """Why the recording could not be predicted; else empty."""


@dataclass(frozen=True, config=STRICT)
class PairOutcome:
    """Comparison of the device before and after a change. Errors on the held-out part of the recording from after."""

    changed: str
    """What was changed on the device, in words."""
    before: str
    """File names of the recording from before the change, joined by commas."""
    after: str
    """File names of the recording from after the change, joined by commas."""
    verdict: Outcome
    named: tuple[str, ...]
    """Named effects in words, each with its parameters."""
    returned: tuple[str, ...]
    """Names in the vocabulary of the named effects, and of those that these data cannot distinguish from them."""
    as_before: float | None
    """Error of the model fitted to the recording from before, unchanged."""
    gain: float | None
    """Error of the model from before with one gain factor re-tuned."""
    retuned: float | None
    """Error of the model from before, re-tuned within its tolerances."""
    with_effects: float | None
    """Error of the re-tuned model with the named effects."""
    expected_left: float | None
    """Error of the model from before on the recording from before: the error expected to remain."""


@dataclass(frozen=True, config=STRICT)
class DrawnExcerpt:
    """A held-out stretch in which the named effects change the prediction most; samples in `unit`."""

    record: str
    channel: str
    unit: str
    start_s: float
    step_s: float
    """Time between samples, s."""
    measured: tuple[float, ...]
    """Measured signal; 0 where it is missing."""
    retuned: tuple[float, ...]
    """Prediction of the re-tuned model."""
    after: tuple[float, ...]
    """Prediction of the model with the named effects."""


@dataclass(frozen=True, config=STRICT)
class RealAnswer:
    """Result for one recording. Errors are shares of the signal."""

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
    """Error measure, as in `diagnosis.json`; empty where the recording was refused."""
    fitted: Errors | None
    """Errors on the samples fitted to; None where the recording was refused."""
    held_out: Errors | None
    """Errors on held-out samples; None where the recording was refused."""
    black_box: float | None
    """Held-out error of the black box; None = not computed."""
    where: tuple[str, ...]
    """Sentences on where the mismatch occurs."""
    named: tuple[str, ...]
    """Sentences on the named effects, with their parameters."""
    effects: tuple[str, ...]
    """Names of these effects in the vocabulary."""
    left: str
    """Sentence on the unexplained remainder."""
    remarks: tuple[str, ...]
    """Remarks of the diagnosis, as sentences."""
    numbers: tuple[OwnParameter, ...]
    """Mass, damping and stiffness of the simple model."""
    stretches: tuple[HeldOutStretch, ...]
    """Held-out stretches, by channel."""
    excerpt: DrawnExcerpt | None
    """Excerpt for the figure; None without held-out data."""
    further: tuple[FurtherTest, ...]
    """Predictions of other recordings of the same device."""
    pair: PairOutcome | None
    """Comparison before and after a change of the device; None where none was made."""
    objections: tuple[str, ...]
    """Objections that an expert may raise, as sentences, from the description of the recording."""
    seconds: float
    """Duration of the diagnosis, s."""
    candidates: tuple[Candidate, ...] = ()
    """Best candidates that were not confirmed, in descending order."""
    not_confirmed: tuple[str, ...] = ()
    """These candidates as sentences with their parameters, without the candidate that `answer` states."""


def real_answer_to_json(answer: RealAnswer) -> dict[str, Any]:
    """Convert the document to plain values for JSON, without format and version."""
    return asdict(answer)


def real_answer_from_json(document: dict[str, Any]) -> RealAnswer:
    """Parse the document of an answer. document: plain values without format and version. Raises RealAnswerError
    with a sentence per problem that begins with its place in the document."""
    try:
        return _ADAPTER.validate_json(json.dumps(document), strict=True)
    except ValidationError as error:
        raise RealAnswerError(format_validation_problems(error.errors())) from error


def make_real_answer_schema() -> dict[str, Any]:
    """Return the JSON Schema of the values that `real_answer_to_json` returns."""
    return _ADAPTER.json_schema(mode="serialization")


_ADAPTER: TypeAdapter[RealAnswer] = TypeAdapter(RealAnswer)
