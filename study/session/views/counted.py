"""Numbers of answers in a sentence, one of them included."""


def answers_are(answers: int) -> str:
    """Such as "3 answers are", to be followed by where."""
    return "1 answer is" if answers == 1 else f"{answers} answers are"
