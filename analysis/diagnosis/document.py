"""Document of a diagnosis: the content of `diagnosis.json`, format `hapteq-diagnosis`, version 1.

The data classes define the fields and check that they agree (a verdict with its effects, an effect with the
vocabulary). Shares and probabilities are from 0 to 1; errors are root mean square over the channels, normalised to the
signal. The docstrings of the data classes are published as descriptions in the JSON Schema. `result.assemble_findings`
makes the document; `study.store.formats.diagnosis_file` reads and writes the file.
"""

import json
from typing import Annotated, Any, Literal, Self

from pydantic import ConfigDict, Field, JsonValue, TypeAdapter, ValidationError, model_validator
from pydantic.dataclasses import dataclass

from equalizer.laws.law import ActsOn, Law, parse_law
from equalizer.plant.effect_vocabulary import DISCOVERED_LAW, EFFECTS_BY_NAME, Place
from equalizer.signals.listed_problems import ListedProblemsError

FORMAT, VERSION = "hapteq-diagnosis", 1  # of the file
STRICT = ConfigDict(extra="forbid", allow_inf_nan=False, populate_by_name=True)  # no unknown keys, NaN or infinity

Verdict = Literal["no_mismatch", "parameters", "explained", "partly_explained", "unexplained"]
Share = Annotated[float, Field(ge=0, le=1)]
Rms = Annotated[float | None, Field(ge=0, description="Normalised root mean square; null where it is not known.")]
EffectWord = Annotated[
    str,
    Field(pattern=r"^[a-z][a-z0-9_]{0,63}$", description="Name in the vocabulary, or a new name of the same form."),
]


class DiagnosisError(ListedProblemsError):
    """A document that is not a diagnosis. `problems`: one sentence each."""


@dataclass(frozen=True, config=ConfigDict(extra="forbid"))
class FoundLaw:
    """A law without a name in the vocabulary, as a formula."""

    expression: Annotated[str, Field(description="Formula in the language of laws (docs/formats.md), in SI.")]
    variables: Annotated[tuple[str, ...], Field(description="Signals that the formula uses.")]
    acts_on: Annotated[ActsOn, Field(description="force: the law is added to it; command, response: replaced by it.")]
    axis: str  # axis or channel on which it acts

    @model_validator(mode="after")
    def _require_valid_expression(self) -> Self:
        """Parse the expression in the language of laws; ValueError where it needs other signals than it lists."""
        law = parse_law(self.expression, self.acts_on, self.axis)
        if set(law.variables) != set(self.variables):
            signals = ", ".join(law.variables) or "no signals"
            raise ValueError(f"the law {self.expression} needs {signals}, but its variables list others")
        return self


@dataclass(frozen=True, config=STRICT)
class Mismatch:
    """Part of the recording where model and device differ by more than repeats differ."""

    output: str  # channel of the response
    input: str  # channels of the command, joined by +
    band_hz: tuple[float, float]
    amplitude: float | None
    """Level of the excitation, in the unit of the command; null where all levels are taken together."""
    state: str | None
    """State of the device in which the mismatch occurs, in words ("near v = 0"); null where it depends on none."""
    share: Share
    p_value: Annotated[float, Field(ge=0, le=1)]

    @model_validator(mode="after")
    def _require_rising_band(self) -> Self:
        """Raise ValueError where the limits of the band are negative or do not rise."""
        if not 0 <= self.band_hz[0] < self.band_hz[1]:
            raise ValueError(f"band_hz must rise from 0 or more, not {list(self.band_hz)}")
        return self


@dataclass(frozen=True, config=STRICT)
class Estimate:
    """A parameter with its 95 % interval; null where no interval can be given."""

    value: float
    unit: Annotated[str, Field(min_length=1, description="SI unit in ASCII; 1 for a plain number.")]
    ci95: tuple[float, float] | None = None

    @model_validator(mode="after")
    def _require_rising_interval(self) -> Self:
        """Raise ValueError where the lower limit of the interval is above the upper one."""
        if self.ci95 is not None and self.ci95[0] > self.ci95[1]:
            raise ValueError(f"ci95 must rise, not {list(self.ci95)}")
        return self


@dataclass(frozen=True, config=STRICT)
class Rival:
    """An effect that was considered and not named."""

    effect: EffectWord
    probability: Share
    inseparable: Annotated[bool, Field(description="Whether these data cannot distinguish it from the named effect.")]
    why_not: str  # reason, as a clause


@dataclass(frozen=True, config=STRICT)
class NamedEffect:
    """A physical effect that the model lacks. The effect and its inseparable rivals form the returned set."""

    effect: EffectWord
    place: Place
    axis: Annotated[str | None, Field(description="Axis or channel; null where the effect is common to all.")]
    share: Annotated[Share, Field(description="Share of the mismatch after re-tuning.")]
    probability: Share
    parameters: dict[str, Estimate]
    rivals: tuple[Rival, ...] = ()
    class_: Annotated[
        tuple[EffectWord, ...],
        Field(
            alias="class",
            description="Laws that these data cannot distinguish, the named one first; empty without such laws.",
        ),
    ] = ()
    law: Annotated[FoundLaw | None, Field(description=f"Formula of a {DISCOVERED_LAW}, or of a kept law.")] = None
    held_out_gain: Annotated[
        Estimate | None,
        Field(description="Share of the error power on held-out data that the effect explains, with a 95 % interval."),
    ] = None

    @model_validator(mode="after")
    def _require_vocabulary_entry(self) -> Self:
        """Raise ValueError where the effect lacks its law or main parameter, or contradicts its entry in the
        vocabulary."""
        if self.law is None and self.effect == DISCOVERED_LAW:
            raise ValueError(f"{DISCOVERED_LAW} lacks its law")
        if self.law is not None and self.effect in EFFECTS_BY_NAME:
            raise ValueError(f"{self.effect} is an effect of the catalogue, so it must not have a law")
        entry = EFFECTS_BY_NAME.get(self.effect)
        if entry is None:
            return self
        if self.place != entry.place:
            raise ValueError(f"{self.effect} belongs to the {entry.place}, not to the {self.place}")
        if entry.main.name not in self.parameters:
            raise ValueError(f"{self.effect} lacks its main parameter, {entry.main.name} ({entry.main.unit})")
        return self


@dataclass(frozen=True, config=STRICT)
class Candidate:
    """A physical effect that would explain a part of the mismatch and is not confirmed."""

    effect: EffectWord
    place: Place
    axis: str | None
    parameters: dict[str, float]  # fitted values by the name of the parameter, in SI units
    held_out_gain: Annotated[
        Share, Field(description="Share of the error power on held-out data that it would explain.")
    ]
    share_of_black_box: Annotated[
        Share,
        Field(
            description="The same, as a share of the power of the linear model's error that all laws together explain."
        ),
    ]
    why_not: str
    law: Annotated[FoundLaw | None, Field(description=f"Formula of a {DISCOVERED_LAW}.")] = None


@dataclass(frozen=True, config=STRICT)
class Errors:
    """Errors of one record: given model, re-tuned, with the named effects, and noise known from repeats."""

    before: Rms  # of the given model
    retuned: Rms  # of the re-tuned model
    after: Rms  # of the model with the named effects
    noise: Rms


@dataclass(frozen=True, config=STRICT)
class Fit:
    """Errors on the samples fitted to, and on held-out samples."""

    fit: Errors
    test: Errors


@dataclass(frozen=True, config=STRICT)
class NextExperiment:
    """Recording that would distinguish the rivals."""

    command: str  # description of the command to play
    splits: tuple[str, ...]  # effects that it distinguishes
    why: str


@dataclass(frozen=True, config=STRICT)
class Diagnosis:
    """The whole document."""

    verdict: Verdict
    mismatch: tuple[Mismatch, ...]
    effects: tuple[NamedEffect, ...]
    retuned: Annotated[
        dict[str, JsonValue],
        Field(description="Changes of the model's own parameters by re-tuning (modes: relative); values of constants."),
    ]
    remainder: tuple[Mismatch, ...]
    fit: Fit
    error: Annotated[
        str,
        Field(
            pattern=r"^(free simulation|predicted force|windows of [0-9.]+ s)$",
            description="Measure of the errors: free simulation, windows of a length in s, or predicted force.",
        ),
    ]
    next_experiment: NextExperiment | None
    candidates: Annotated[
        tuple[Candidate, ...], Field(description="Best candidates that were not confirmed, in descending order.")
    ] = ()

    @model_validator(mode="after")
    def _require_consistent_verdict(self) -> Self:
        """Raise ValueError where the verdict contradicts the effects, the remainder or the mismatch."""
        named = self.verdict in ("explained", "partly_explained")
        if named != bool(self.effects):
            raise ValueError(
                f"the verdict '{self.verdict}' requires {'one effect or more' if named else 'an empty list of effects'}"
            )
        if self.verdict == "partly_explained" and not self.remainder:
            raise ValueError("the verdict 'partly_explained' requires a remainder")
        if self.verdict == "unexplained" and not self.mismatch:
            raise ValueError("the verdict 'unexplained' requires a mismatch")
        return self

    @property
    def returned_set(self) -> tuple[str, ...]:
        """Names of the named effects and of every rival that these data cannot distinguish from them."""
        names = [name for effect in self.effects for name in (effect.effect, *_list_inseparable(effect))]
        return tuple(dict.fromkeys(names))


def diagnosis_to_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """Convert the diagnosis to JSON values, without format, version, and empty class, gains, laws and candidates."""
    document: dict[str, Any] = _ADAPTER.dump_python(diagnosis, mode="json", by_alias=True)
    effects, candidates = document["effects"], document["candidates"]
    optional_entries = [(effect, optional_key) for effect in effects for optional_key in ("class", "held_out_gain")]
    optional_entries += [(entry, "law") for entry in (*effects, *candidates)]
    for entry, optional_key in ((document, "candidates"), *optional_entries):
        if not entry[optional_key]:
            del entry[optional_key]
    return document


def diagnosis_from_json(document: dict[str, Any]) -> Diagnosis:
    """Parse the document of a diagnosis. document: without format and version. Raises DiagnosisError with all problems,
    each with the path of its entry."""
    try:
        # Through JSON: strict checking then accepts a list for a tuple, but no text for a number.
        return _ADAPTER.validate_json(json.dumps(document), strict=True)
    except ValidationError as error:
        raise DiagnosisError(
            tuple(
                _format_problem(problem["loc"], _PYDANTIC_MESSAGES.get(problem["type"], problem["msg"]))
                for problem in error.errors()
            )
        ) from error


def build_diagnosis_schema() -> dict[str, Any]:
    """Build the JSON Schema of what `diagnosis_to_json` returns."""
    return _ADAPTER.json_schema(mode="serialization")


def _list_inseparable(effect: NamedEffect) -> tuple[str, ...]:
    """List the names of the rivals that the data cannot distinguish from the effect."""
    return tuple(rival.effect for rival in effect.rivals if rival.inseparable)


_PYDANTIC_MESSAGES = {"unexpected_keyword_argument": "this key is unknown", "missing": "this is missing"}
"""Messages that replace those of pydantic, by type of error."""


def _format_problem(entry_path: tuple[str | int, ...], message: str) -> str:
    """Format a message after the path of its entry; without a path for the whole document."""
    joined_path = ".".join(str(key) for key in entry_path)
    text = message.removeprefix("Value error, ")
    return f"{joined_path}: {text}" if joined_path else text


_ADAPTER: TypeAdapter[Diagnosis] = TypeAdapter(Diagnosis)


def make_found_law(law: Law) -> FoundLaw:
    """Convert a law to an entry of the document: formula with values, variables, what it acts on, and axis."""
    return FoundLaw(law.text, law.variables, law.acts_on, law.axis)


def format_law(law: FoundLaw, force_unit: str = "") -> str:
    """Format a law: as "F = -4.1*abs(vy)**1.5*sign(vy) N" the force or torque that it adds, else what replaces a
    command or reading. force_unit: of that force; empty where it is not known or a plain number."""
    if law.acts_on == "force":
        return f"F = {law.expression} {force_unit}".rstrip()
    replaced_signal = "command" if law.acts_on == "command" else "reading"
    return f"in place of the {replaced_signal} of {law.axis}: {law.expression}"
