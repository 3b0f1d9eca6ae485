"""Parse the text of a protocol file into a protocol, or into a list of all its problems."""

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

_KINDS = " or ".join(f'"{kind}"' for kind in ADAPTERS)


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
        """The file, as its reader knows it."""
        self.problems = problems
        self.key, self.problem, self.allowed = problems[0].key, problems[0].problem, problems[0].allowed


def load_protocol(text: str, source: str) -> Protocol:
    """Read a protocol from TOML text. source: the file's name, for messages. Raises ProtocolError."""
    try:
        values = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        # Its message ends with line and column, but for one case.
        end = f"(at line {len(text.splitlines())}, the end of the text)"
        problem = f"is not TOML: {error}".replace("(at end of document)", end)
        raise ProtocolError(source, (Problem("The text", problem, "TOML 1.0"),)) from error
    except (ValueError, RecursionError) as error:
        problem = f"cannot be read: {type(error).__name__} ({error})"
        raise ProtocolError(source, (Problem("The text", problem, "numbers and nesting of ordinary size"),)) from error
    return protocol_from_values(values, source)


def protocol_from_values(values: dict[str, Any], source: str) -> Protocol:
    """Check plain values from TOML or JSON and make the protocol. Numbers must be numbers, not text or booleans.
    Raises ProtocolError."""
    if unsupported := tuple(_find_unsupported_values(values, "")):
        raise ProtocolError(source, unsupported)
    kind = values.get("kind")
    if not isinstance(kind, str) or kind not in ADAPTERS:
        wrong = (
            "is missing" if kind is None else f'is "{kind}"' if isinstance(kind, str) else f"is {describe_value(kind)}"
        )
        raise ProtocolError(source, (Problem("kind", wrong, _KINDS),))
    try:
        # By way of JSON, because strict checking then takes a list for a tuple and a whole number for a real one,
        # but still no text and no truth value for a number.
        protocol: Protocol = ADAPTERS[kind].validate_json(json.dumps(values), strict=True)
    except ValidationError as error:
        raise ProtocolError(source, collect_problems(make_protocol_schema(kind), error.errors())) from error
    return protocol


def _find_unsupported_values(value: Any, path: str) -> list[Problem]:
    """Values that TOML allows and protocols do not: dates, and integers of unlimited length."""
    match value:
        case dict():
            return [
                problem
                for key, item in value.items()
                for problem in _find_unsupported_values(item, f"{path}.{key}" if path else key)
            ]
        case list():
            return [
                problem
                for i, item in enumerate(value, start=1)
                for problem in _find_unsupported_values(item, f"{path}[{i}]")
            ]
        case datetime.date() | datetime.time():
            return [Problem(path, f"is {value}, a date or time", "text in quotes or a number")]
        case int() if abs(value) >= 2**64:
            return [Problem(path, "is a whole number of more than 64 bits", "a number of ordinary size")]
        case _:
            return []
