"""The energy gateway: wall clock and site limit."""

from .wire import GATEWAY_NODE, Wire

PERIOD_S = 1.0
VALIDITY_S = 5
SITE_LIMIT, TIME_SYNC = "SITE_LIMIT", "TIME_SYNC"
CLOCK_QUALITY = 40


class Gateway:
    """`schedule`: ascending (bus seconds since the start, limit [W]); the first holds before its time too."""

    def __init__(self, schedule: list[tuple[float, float]], failsafe_W: float):
        self._schedule, self._failsafe_W = schedule, failsafe_W
        self._counter = {SITE_LIMIT: 0, TIME_SYNC: 0}
        self._due_s = {SITE_LIMIT: 0.0, TIME_SYNC: 0.0}
        self._told_W: float | None = None

    def limit_W(self, since_start_s: float) -> float:
        passed = [limit_W for at_s, limit_W in self._schedule if at_s <= since_start_s]
        return passed[-1] if passed else self._schedule[0][1]

    def due(self, wire: Wire, now_s: float, since_start_s: float, world_unix_s: float) -> list[tuple[int, bytes]]:
        """The frames to send now."""
        frames = []
        limit_W = self.limit_W(since_start_s)
        if limit_W != self._told_W or now_s >= self._due_s[SITE_LIMIT]:
            self._told_W = limit_W
            frames.append(self._frame(wire, now_s, SITE_LIMIT, {
                "active": 1, "limit": limit_W, "failsafe_limit": self._failsafe_W, "failsafe_duration": None,
                "validity": VALIDITY_S}))
        if now_s >= self._due_s[TIME_SYNC]:
            frames.append(self._frame(wire, now_s, TIME_SYNC, {
                "unix_time": int(world_unix_s), "millisecond": int(world_unix_s % 1 * 1000),
                "quality": CLOCK_QUALITY}))
        return frames

    def _frame(self, wire: Wire, now_s: float, name: str, values: dict) -> tuple[int, bytes]:
        self._due_s[name] = now_s + PERIOD_S
        counter = self._counter[name]
        self._counter[name] = (counter + 1) % 16
        return wire.frame(name, GATEWAY_NODE, counter, values)
