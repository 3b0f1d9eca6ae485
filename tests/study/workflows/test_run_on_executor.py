"""Pieces of work on an executor: what finished is handed over before an error ends the whole."""

from concurrent.futures import Executor, Future

import pytest

from study.workflows.run_on_executor import finished_pieces


class AtOnce(Executor):
    """Every piece is done as soon as it is handed over."""

    def submit(self, function, /, *arguments, **named):
        future: Future = Future()
        try:
            future.set_result(function(*arguments, **named))
        except ZeroDivisionError as error:
            future.set_exception(error)
        return future


def test_results_that_are_there_come_before_an_error_beside_them():
    pieces = [(number, (12, number % 2)) for number in range(20)]
    came = []
    with pytest.raises(ZeroDivisionError):
        for key, _ in finished_pieces(AtOnce(), divmod, pieces):
            came.append(key)
    assert sorted(came) == [number for number in range(20) if number % 2]
