"""Texts of the panel that is shown when something ended."""

from protocols.wording.words import ENGLISH_WORDS, Words
from study.tui.engine.from_engine import Failed, Finished
from study.tui.screens.outcome import Decision, Outcome

UNHEARD_AFTER_S = 2.0
"""Time without an answer of the engine to a stop (s) after which the panel says so."""


def stop_told_panel(words: Words) -> Outcome:
    """Panel after a stop was asked for: the engine was told."""
    return Outcome(words["stop_title"], (("", words["stop_told"]),), ("quit",), words=words)


def stop_unanswered_panel(words: Words) -> Outcome:
    """Panel after the engine did not answer a stop in time."""
    unheard = words.fill("stop_unheard", {"seconds": f"{UNHEARD_AFTER_S:g}"})
    texts = (unheard, words["stop_safe"], words["stop_do_now"])
    return Outcome(words["stop_unheard_title"], tuple(("", text) for text in texts), ("quit",), words=words)


def failure_outcome(failure: Failed, at_home: bool, words: Words = ENGLISH_WORDS) -> Outcome:
    """Panel for a failure. at_home: nothing was running, and the screen below continues. words: of the participant,
    who may still sit there."""
    error = failure.error
    parts = (("What happened", error.happened), ("What is safe", error.saved), ("What to do now", error.do_now))
    decisions: tuple[Decision, ...] = ("back",) if at_home else ("home", "quit")
    paragraphs = tuple((heading, text) for heading, text in parts if text)
    return Outcome(error.title, (*_for_whom(words), *paragraphs), ("resume", *decisions) if failure.path else decisions)


def completion_outcome(end: Finished, words: Words = ENGLISH_WORDS) -> Outcome:
    """Panel for a finished session. words: of the participant."""
    results = end.results
    parts = (
        ("Thresholds", "\n".join(results.table)),
        ("To know", "\n".join(f"• {warning}" for warning in results.warnings)),
        ("Report", results.report),
    )
    paragraphs = tuple((heading, text) for heading, text in parts if text)
    title = f"The session is finished: {end.answers} answers"
    return Outcome(title, (*_for_whom(words), *paragraphs), ("look", "home", "quit"), grave=False)


def _for_whom(words: Words) -> tuple[tuple[str, str], ...]:
    """English is the experimenter's: stated in the participant's language, where that is another."""
    return () if words == ENGLISH_WORDS else (("", words["for_experimenter"]),)
