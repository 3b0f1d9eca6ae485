"""Texts of the panel that is shown after a session, a stop or a failure."""

from protocols.wording.words import ENGLISH_WORDS, Words
from study.tui.engine.from_engine import Failed, Finished
from study.tui.screens.outcome import Decision, Outcome

STOP_REPLY_TIMEOUT_S = 2.0
"""Time without an answer of the engine to a stop (s) after which the panel states that it did not answer. Chosen."""


def make_stop_sent_outcome(words: Words) -> Outcome:
    """Make the panel after Ctrl-C: the stop was sent to the engine."""
    return Outcome(words["stop_title"], (("", words["stop_told"]),), ("quit",), words=words)


def make_stop_unanswered_outcome(words: Words) -> Outcome:
    """Make the panel for a stop that the engine did not answer within `STOP_REPLY_TIMEOUT_S`."""
    unanswered_text = words.fill("stop_unheard", {"seconds": f"{STOP_REPLY_TIMEOUT_S:g}"})
    texts = (unanswered_text, words["stop_safe"], words["stop_do_now"])
    return Outcome(words["stop_unheard_title"], tuple(("", text) for text in texts), ("quit",), words=words)


def make_failure_outcome(failure: Failed, at_home: bool, words: Words = ENGLISH_WORDS) -> Outcome:
    """Make the panel for a failure, with "resume" where it names a session. at_home: no sitting was running, and the
    screen below continues. words: texts in the participant's language."""
    error = failure.error
    sections = (("What happened", error.happened), ("What is safe", error.saved), ("What to do now", error.do_now))
    decisions: tuple[Decision, ...] = ("back",) if at_home else ("home", "quit")
    paragraphs = tuple((heading, text) for heading, text in sections if text)
    return Outcome(
        error.title,
        (*_make_addressee_paragraphs(words), *paragraphs),
        ("resume", *decisions) if failure.path else decisions,
    )


def make_completion_outcome(finished: Finished, words: Words = ENGLISH_WORDS) -> Outcome:
    """Make the panel for a finished session: thresholds, warnings, path of the report. words: texts in the
    participant's language."""
    results = finished.results
    sections = (
        ("Thresholds", "\n".join(results.table)),
        ("To know", "\n".join(f"• {warning}" for warning in results.warnings)),
        ("Report", results.report),
    )
    paragraphs = tuple((heading, text) for heading, text in sections if text)
    title = f"The session is finished: {finished.answers} answers"
    return Outcome(title, (*_make_addressee_paragraphs(words), *paragraphs), ("look", "home", "quit"), is_problem=False)


def _make_addressee_paragraphs(words: Words) -> tuple[tuple[str, str], ...]:
    """Make the paragraph that states, in the participant's language, that the English text is for the experimenter;
    none where the participant's language is English."""
    return () if words == ENGLISH_WORDS else (("", words["for_experimenter"]),)
