"""Number of answers with the right verb, for sentences."""


def answers_are(answers: int) -> str:
    """A count with its verb, such as "3 answers are" or "1 answer is"."""
    return "1 answer is" if answers == 1 else f"{answers} answers are"
