"""Number of answers with the form of the verb that agrees with it, for messages at the end of a sitting.

Called by `run_session`, `resume_session` and `end_sitting` of `study.workflows.session`.
"""


def format_answer_count(answer_count: int) -> str:
    """Format a number of answers with its verb: "1 answer is", "0 answers are", "3 answers are"."""
    return "1 answer is" if answer_count == 1 else f"{answer_count} answers are"
