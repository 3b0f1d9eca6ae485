"""Table of the answers to a protocol's questionnaires, for exported data: a row per session, a column per question."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from protocols.definition.participant_text import Question
from protocols.definition.study_protocol import StudyProtocol
from study.store.disk.csv_rows import format_csv_line

FORM_NAMES = {"before": "questionnaire", "debrief": "debrief"}
"""Name of a form in the session log, by the protocol's table of its questions ([[before]], [[debrief]])."""


@dataclass(frozen=True, slots=True)
class FilledForm:
    """A filled form, as in the session log."""

    subject: str
    """Code of the participant."""
    session: str
    form: str
    """Name of the form, such as a value of `FORM_NAMES`."""
    answers: Mapping[str, str]
    """Logged answer by the key of the question."""


@dataclass(frozen=True, slots=True)
class AnswerColumn:
    """A question of the protocol as a column of the table."""

    table: str
    """The protocol's table with this question: a key of `FORM_NAMES`."""
    question: Question

    @property
    def name(self) -> str:
        """Name of the column: table and key of the question, as in `debrief_effort`."""
        return f"{self.table}_{self.question.key}"

    @property
    def description(self) -> str:
        """Text of the question, and the meaning of its coded answers in parentheses, as a single line."""
        question, meaning = self.question, "; ".join(f"{code}: {level}" for code, level in self.levels.items())
        return f"{' '.join(question.question.split())}{f' ({meaning})' if meaning else ''}"

    @property
    def levels(self) -> dict[str, str]:
        """Meaning of each coded value. Rating scale: of its first and last step only. Choices: a choice whose code is
        its own text is left out. Empty for numbers and free text."""
        question = self.question
        if question.ends:
            return {question.steps[0]: question.ends[0], question.steps[-1]: question.ends[1]}
        choices_by_code = dict(zip(question.codes, question.choices, strict=False))
        return {code: choice for code, choice in choices_by_code.items() if code != choice}


@dataclass(frozen=True, slots=True)
class AnswerTable:
    """Answers to the protocol's questions."""

    columns: tuple[AnswerColumn, ...] = ()
    rows: tuple[tuple[str, str, tuple[str, ...]], ...] = ()
    """Per row: subject, session, and the answer of each column; empty text for a missing answer."""

    @property
    def header(self) -> tuple[str, ...]:
        return ("subject", "session", *(column.name for column in self.columns))

    def as_csv(self) -> str:
        """Format the table as CSV text, header included."""
        lines = [self.header, *((subject, session, *answers) for subject, session, answers in self.rows)]
        return "".join(format_csv_line(line) + "\n" for line in lines)


def make_answer_table(protocol: StudyProtocol, forms: Sequence[FilledForm], include_free_text: bool) -> AnswerTable:
    """Make the table of the sessions with a filled form of `FORM_NAMES`; without rows where it has no columns.

    forms: in the order of logging; of two answers to the same question in a session, the later one counts.
    include_free_text: whether to include free-text answers, which may contain health data or names of persons.
    """
    question_tables = {"before": protocol.before, "debrief": protocol.debrief}
    columns = tuple(
        AnswerColumn(table, question)
        for table, questions in question_tables.items()
        for question in questions
        if include_free_text or not question.is_free_text
    )
    answers_by_question = {(form.subject, form.session, form.form, key): answer
            for form in forms for key, answer in form.answers.items()}  # fmt: skip
    sessions = dict.fromkeys((form.subject, form.session) for form in forms if form.form in FORM_NAMES.values())
    rows = tuple(
        (subject, session, tuple(
            answers_by_question.get((subject, session, FORM_NAMES[column.table], column.question.key), "")
            for column in columns
        ))
        for subject, session in sessions
    )  # fmt: skip
    return AnswerTable(columns, rows if columns else ())
