"""Table of the answers to a protocol's questionnaires, for exported data.

A row for each session and a column for each question that the protocol asks before or after the trials. The exports
`psych_ds` and `bids_behaviour` describe the columns by the text of the questions.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from protocols.definition.participant_text import Question
from protocols.definition.study_protocol import StudyProtocol
from study.store.disk.csv_rows import format_csv_line

FORM_NAMES = {"before": "questionnaire", "debrief": "debrief"}
"""Name of the form in the log for each table of questions in a protocol ([[before]], [[debrief]])."""


@dataclass(frozen=True, slots=True)
class FilledForm:
    """A form that a participant filled in, as it was logged."""

    subject: str
    """Code of the participant."""
    session: str
    """Name of the session."""
    form: str
    """Name of the form, as in `FORM_NAMES`."""
    answers: Mapping[str, str]
    """Logged answers by the keys of the questions."""


@dataclass(frozen=True, slots=True)
class AnswerColumn:
    """A question of the protocol as a column of the table."""

    table: str
    """The protocol's table of questions: before or debrief."""
    question: Question

    @property
    def name(self) -> str:
        """Name of the column: table and key of the question, as in `debrief_effort`."""
        return f"{self.table}_{self.question.key}"

    @property
    def description(self) -> str:
        """The question and the meaning of its coded answers, as a single line."""
        question, meaning = self.question, "; ".join(f"{code}: {level}" for code, level in self.levels.items())
        return f"{' '.join(question.question.split())}{f' ({meaning})' if meaning else ''}"

    @property
    def levels(self) -> dict[str, str]:
        """Meaning of each coded value, for a scale of its two ends only. Values whose code equals the text of the
        choice are left out; empty for numbers and free text."""
        question = self.question
        if question.ends:
            return {question.steps[0]: question.ends[0], question.steps[-1]: question.ends[1]}
        by_code = dict(zip(question.codes, question.choices, strict=False))
        return {code: choice for code, choice in by_code.items() if code != choice}


@dataclass(frozen=True, slots=True)
class AnswerTable:
    """Answers to the protocol's questions: a row per session, a column per question."""

    columns: tuple[AnswerColumn, ...] = ()
    rows: tuple[tuple[str, str, tuple[str, ...]], ...] = ()
    """Subject, session, and an answer for each column, empty where none was given."""

    @property
    def header(self) -> tuple[str, ...]:
        """Names of the columns: subject, session, and the questions."""
        return ("subject", "session", *(column.name for column in self.columns))

    def as_csv(self) -> str:
        """The table as CSV text, header included."""
        lines = [self.header, *((subject, session, *answers) for subject, session, answers in self.rows)]
        return "".join(format_csv_line(line) + "\n" for line in lines)


def answer_table(protocol: StudyProtocol, forms: Sequence[FilledForm], free_text: bool) -> AnswerTable:
    """The table of all sessions with a filled form; empty where the protocol asks nothing.

    free_text: include answers in the participants' own words, which may be about their health or name a person. Where a
    form was filled in twice, the later answer counts.
    """
    question_tables = {"before": protocol.before, "debrief": protocol.debrief}
    columns = tuple(
        AnswerColumn(table, question)
        for table, questions in question_tables.items()
        for question in questions
        if free_text or not question.is_free_text
    )
    by_question = {(form.subject, form.session, form.form, key): answer
            for form in forms for key, answer in form.answers.items()}  # fmt: skip
    sessions = dict.fromkeys((form.subject, form.session) for form in forms if form.form in FORM_NAMES.values())
    rows = tuple(
        (subject, session, tuple(
            by_question.get((subject, session, FORM_NAMES[column.table], column.question.key), "") for column in columns
        ))
        for subject, session in sessions
    )  # fmt: skip
    return AnswerTable(columns, rows if columns else ())
