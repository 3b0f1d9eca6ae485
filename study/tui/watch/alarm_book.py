"""Which alarms somebody has seen, and when the bell rings. Values in, values out; the time is given."""

from collections.abc import Sequence

from study.session.watching.watch_view import Alarm

RING_EVERY_S = 4.0
FORGOTTEN_AFTER_S = 10.0
"""An alarm that flickers is not a new one each time; one that comes back after so long is."""

Key = tuple[str, str]


class AlarmBook:
    def __init__(self) -> None:
        self._alarms: tuple[Alarm, ...] = ()
        self._seen: dict[Key, float] = {}
        """Acknowledged, and when it was last there."""
        self._rung: dict[Key, float] = {}
        self._rang_s = float("-inf")

    @property
    def unseen(self) -> tuple[Alarm, ...]:
        return tuple(alarm for alarm in self._alarms if _key(alarm) not in self._seen)

    @property
    def seen(self) -> tuple[Alarm, ...]:
        return tuple(alarm for alarm in self._alarms if _key(alarm) in self._seen)

    def take(self, alarms: Sequence[Alarm], now_s: float) -> bool:
        """The alarms of now. Returns whether the bell is to ring."""
        self._alarms = tuple(alarms)
        present = {_key(alarm) for alarm in alarms}
        for book in (self._seen, self._rung):
            book.update({key: now_s for key in book if key in present})
            for key in [key for key, last_s in book.items() if now_s - last_s > FORGOTTEN_AFTER_S]:
                del book[key]
        new = [_key(alarm) for alarm in self.unseen if _key(alarm) not in self._rung]
        again = any(alarm.urgent for alarm in self.unseen) and now_s - self._rang_s >= RING_EVERY_S
        if not new and not again:
            return False
        self._rung.update(dict.fromkeys(new, now_s))
        self._rang_s = now_s
        return True

    def acknowledge(self, now_s: float) -> int:
        """All that are there are seen. Returns how many were not before."""
        unseen = self.unseen
        self._seen.update({_key(alarm): now_s for alarm in unseen})
        return len(unseen)


def _key(alarm: Alarm) -> Key:
    return alarm.kind, alarm.since if alarm.event else ""
