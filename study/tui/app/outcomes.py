"""Texts of the panel that is shown when something ended."""

from study.tui.engine.from_engine import Failed, Finished
from study.tui.screens.outcome import Decision, Outcome

UNHEARD_AFTER_S = 2.0

LETTING_GO = Outcome(
    "Letting go",
    (("", "The device program was told to take the force away and to end the sitting. It answers in a moment."),),
    ("quit",),
)
UNHEARD = Outcome(
    "The stop was not answered",
    (
        ("What happened", f"The device program has not answered for {UNHEARD_AFTER_S:g} s."),
        ("What is safe", "Every answer that was given is on disk."),
        (
            "What to do now",
            "Take the hand off the handle and switch the device off. Then leave hapteq: that ends the device program. "
            "The session can be resumed.",
        ),
    ),
    ("quit",),
)


def failure_outcome(failure: Failed, at_home: bool) -> Outcome:
    """Panel for a failure. at_home: nothing was running, and the screen below continues."""
    error = failure.error
    parts = (("What happened", error.happened), ("What is safe", error.saved), ("What to do now", error.do_now))
    way_on: tuple[Decision, ...] = ("back",) if at_home else ("home", "quit")
    paragraphs = tuple((heading, text) for heading, text in parts if text)
    return Outcome(error.title, paragraphs, ("resume", *way_on) if failure.path else way_on)


def completion_outcome(end: Finished) -> Outcome:
    """Panel for a finished session."""
    results = end.results
    parts = (
        ("Thresholds", "\n".join(results.table)),
        ("To know", "\n".join(f"• {warning}" for warning in results.warnings)),
        ("Report", results.report),
    )
    paragraphs = tuple((heading, text) for heading, text in parts if text)
    title = f"The session is finished: {end.answers} answers"
    return Outcome(title, paragraphs, ("look", "home", "quit"), grave=False)
