"""A thread that waits for one last thing to do, so that a driver that hangs does not hang whoever asks for it."""

import threading
from collections.abc import Callable
from queue import Empty, SimpleQueue


class Standby:
    """Started beforehand: no thread can be started any more while the interpreter ends."""

    def __init__(self, action: Callable[[], None], name: str) -> None:
        self._action = action
        self._asked: SimpleQueue[SimpleQueue[bool] | None] = SimpleQueue()
        threading.Thread(target=self._work, name=name, daemon=True).start()

    def run(self, patience_s: float) -> bool:
        """Whether it was done within patience_s, without an error. It goes on even if the caller is interrupted."""
        answer: SimpleQueue[bool] = SimpleQueue()
        self._asked.put(answer)
        try:
            return answer.get(timeout=patience_s)
        except Empty:
            return False

    def end(self) -> None:
        """After what was asked for so far."""
        self._asked.put(None)

    def _work(self) -> None:
        while (answer := self._asked.get()) is not None:
            try:
                self._action()
                answer.put(True)
            except BaseException:  # noqa: BLE001 - the answer says so, and the next one who asks needs this thread
                answer.put(False)
