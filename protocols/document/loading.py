"""Reading of a protocol from TOML text or plain values; an invalid one is reported with all its problems.

Order: parse the TOML, refuse values that no protocol has, choose the schema by the key `kind`, validate with Pydantic.
Called by `study.store.formats.participant_texts`, which inserts a language's texts before the validation, and by the
workflows that read a session's copy of its protocol. Inverse: `dumping`.
"""

import datetime
import json
import tomllib
from typing import Any

from pydantic import ValidationError

from protocols.definition.problem import Problem
from protocols.definition.recording_protocol import RecordingProtocol
from protocols.definition.study_protocol import StudyProtocol
from protocols.document.schema import ADAPTERS, make_protocol_schema
from protocols.document.validation_messages import collect_problems, describe_value

Protocol = StudyProtocol | RecordingProtocol

_KIND_CHOICES = " or ".join(f'"{kind}"' for kind in ADAPTERS)
"""Allowed values of the key `kind`, for messages."""


class ProtocolError(ValueError):
    """A protocol that cannot be used. `key`, `problem` and `allowed` are those of the first problem."""

    def __init__(self, source: str, problems: tuple[Problem, ...]) -> None:
        if len(problems) == 1:
            message = f"{source}: {problems[0]}"
        else:
            lines = [f"{number}. {problem}" for number, problem in enumerate(problems, start=1)]
            message = "\n  ".join([f"{source} has {len(problems)} problems:", *lines])
        super().__init__(message)
        self.source = source
        """Name of the file, for messages."""
        self.problems = problems
        self.key, self.problem, self.allowed = problems[0].key, problems[0].problem, problems[0].allowed


def load_protocol(text: str, source: str) -> Protocol:
    """Read a protocol from TOML text. source: the file's name, for messages. Raises ProtocolError where the text is no
    TOML or `protocol_from_values` refuses its values."""
    try:
        values = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        # The message of tomllib states line and column, except at the end of the text.
        end_position = f"(at line {len(text.splitlines())}, the end of the text)"
        problem_text = f"is not TOML: {error}".replace("(at end of document)", end_position)
        raise ProtocolError(source, (Problem("The text", problem_text, "TOML 1.0"),)) from error
    except (ValueError, RecursionError) as error:
        problem_text = f"cannot be read: {type(error).__name__} ({error})"
        raise ProtocolError(
            source, (Problem("The text", problem_text, "numbers and nesting of ordinary size"),)
        ) from error
    return protocol_from_values(values, source)


def protocol_from_values(values: dict[str, Any], source: str) -> Protocol:
    """Check plain values from TOML or JSON and make the protocol. Numbers must be numbers, not text or booleans. Raises
    ProtocolError, with all problems, where a value is unsupported or invalid, or `kind` is missing or unknown."""
    if unsupported := tuple(_find_unsupported_values(values, "")):
        raise ProtocolError(source, unsupported)
    kind = values.get("kind")
    if not isinstance(kind, str) or kind not in ADAPTERS:
        problem_text = (
            "is missing" if kind is None else f'is "{kind}"' if isinstance(kind, str) else f"is {describe_value(kind)}"
        )
        raise ProtocolError(source, (Problem("kind", problem_text, _KIND_CHOICES),))
    try:
        # Validated as JSON: the strict mode then accepts a list for a tuple and an integer for a float, but neither
        # text nor a boolean for a number.
        protocol: Protocol = ADAPTERS[kind].validate_json(json.dumps(values), strict=True)
    except ValidationError as error:
        raise ProtocolError(source, collect_problems(make_protocol_schema(kind), error.errors())) from error
    return protocol


def _find_unsupported_values(value: Any, path: str) -> list[Problem]:
    """Find values that TOML allows and protocols do not: dates, times, and integers of more than 64 bits. path: dotted
    key of the value, empty for the document; list entries count from 1."""
    match value:
        case dict():
            return [
                problem
                for key, entry in value.items()
                for problem in _find_unsupported_values(entry, f"{path}.{key}" if path else key)
            ]
        case list():
            return [
                problem
                for number, entry in enumerate(value, start=1)
                for problem in _find_unsupported_values(entry, f"{path}[{number}]")
            ]
        case datetime.date() | datetime.time():
            return [Problem(path, f"is {value}, a date or time", "text in quotes or a number")]
        case int() if abs(value) >= 2**64:
            return [Problem(path, "is a whole number of more than 64 bits", "a number of ordinary size")]
        case _:
            return []
