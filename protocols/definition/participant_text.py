"""Texts of the participant's screens, and questionnaire items of a study protocol.

Each class is a table of the TOML file; Pydantic checks its values. Part of `study_protocol`; the answers are written by
`study.store.formats.answer_table`.
"""

from dataclasses import field
from typing import Annotated, Self

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from protocols.definition.problem import Problem, refuse
from protocols.definition.staircase_rule import STRICT

Sentence = Annotated[str, Field(min_length=1, max_length=500)]
"""Text that a participant reads in one piece, such as a question or a statement of consent."""
Key = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,39}$")]
"""Name of a question's answer in the log: a lower-case letter, then up to 39 such letters, digits and underscores."""
AnswerText = Annotated[str, Field(min_length=1, max_length=80)]
"""Logged value of an answer, or meaning of an end of a scale: short enough for a table."""
MAX_CHOICES = 9
"""Largest number of answers to choose from: each has a key from 1 to 9."""
MAX_SCALE_STEPS = 11
"""Largest number of steps of a rating scale. Chosen: 0 to 10."""


@dataclass(frozen=True, config=STRICT)
class TextSettings:
    """Texts of the participant's screens. They are part of the protocol's hash."""

    language: str = Field(
        default="en",
        min_length=1,
        max_length=200,
        description="'de' (German), 'es' (Spanish), or the path of a TOML file with all texts, relative to the "
        "folder of the protocol; `hapteq protocol texts` prints a table to translate. Default 'en', English.",
    )
    words: Annotated[
        dict[str, str],
        Field(
            description="Replacements of single texts, by the keys that `hapteq protocol texts` lists. If a language "
            "is named, all its texts are filled in here when the protocol is read. Default: none."
        ),
    ] = field(default_factory=dict, hash=False)

    @model_validator(mode="after")
    def _require_texts(self) -> Self:
        """Raise InconsistentError for a language other than English without its texts."""
        if self.language != "en" and not self.words:
            allowed = "the texts themselves in text.words, which `hapteq` fills in where it reads the file"
            refuse([Problem("language", f'is "{self.language}", and its texts are missing', allowed)])
        return self


@dataclass(frozen=True, config=STRICT)
class Question:
    """A question before the trials or after the last run, answered by a choice, a number, a step of a scale, or,
    without these, by free text. An answer is optional."""

    key: Annotated[Key, Field(description="Name of the answer in the log.")]
    question: Annotated[Sentence, Field(description="Text of the question.")]
    choices: tuple[Sentence, ...] = Field(
        default=(), max_length=MAX_CHOICES, description="Answers to choose from. Default: none, see number and scale."
    )
    codes: tuple[AnswerText, ...] = Field(
        default=(),
        max_length=MAX_CHOICES,
        description="Logged value of each choice, the same in every language. Default: the choices as written.",
    )
    number: tuple[float, ...] = Field(
        default=(), max_length=2, description="Lowest and highest accepted number, such as [18, 99]. Default: none."
    )
    unit: Annotated[str, Field(max_length=20, description="Unit of the number, for tables. Default: none.")] = ""
    scale: tuple[int, ...] = Field(
        default=(), max_length=2, description="First and last step of a rating scale, such as [1, 7]. Default: none."
    )
    ends: tuple[AnswerText, ...] = Field(
        default=(), max_length=2, description="Meaning of the two ends of the scale. Default: not stated."
    )

    @property
    def steps(self) -> tuple[str, ...]:
        """Texts of the steps of the scale, first to last; empty without a scale."""
        return tuple(str(step) for step in range(self.scale[0], self.scale[1] + 1)) if self.scale else ()

    @property
    def is_free_text(self) -> bool:
        """Whether the answer is free text: neither choices, number nor scale are given."""
        return not (self.choices or self.number or self.scale)

    @model_validator(mode="after")
    def _require_consistent_answer(self) -> Self:
        """Raise InconsistentError where the fields contradict each other."""
        refuse(list(_find_answer_problems(self)))
        return self


def _find_answer_problems(question: Question) -> tuple[Problem, ...]:
    """Find contradictions between the fields of a question, repeated entries, and invalid limits of number or scale."""
    problems = []
    if sum(map(bool, (question.choices, question.number, question.scale))) > 1:
        problems.append(
            Problem("choices", "is given together with number or scale", "only one of choices, number and scale")
        )
    if question.codes and len(question.codes) != len(question.choices):
        problem_text = f"has {len(question.codes)} entries for {len(question.choices)} choices"
        problems.append(Problem("codes", problem_text, "one for each of the choices, or none"))
    if any(len(set(entries)) < len(entries) for entries in (question.codes, question.choices)):
        problems.append(Problem("choices", "or its codes have an entry twice", "different entries"))
    if question.number and not (len(question.number) == 2 and question.number[0] < question.number[1]):
        problems.append(Problem("number", f"is {list(question.number)}", "the lowest and then the highest number"))
    scale = question.scale
    if scale and not (len(scale) == 2 and 0 <= scale[0] < scale[1] < scale[0] + MAX_SCALE_STEPS):
        allowed = f"the first and the last of 2 to {MAX_SCALE_STEPS} steps, none below 0"
        problems.append(Problem("scale", f"is {list(scale)}", allowed))
    if question.ends and not (scale and len(question.ends) == 2):
        problems.append(Problem("ends", "does not match the scale", "two texts, together with a scale"))
    if question.unit and not question.number:
        problems.append(Problem("unit", "is given without a number", "empty, or together with number"))
    return tuple(problems)
