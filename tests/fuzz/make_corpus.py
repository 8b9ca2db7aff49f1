"""Write the hand-made part of the fuzzing corpus: golden frames, the ends of every field, and one scene per fault.

    python3 tests/fuzz/make_corpus.py tests/fuzz/corpus

The format is in fuzz_frames.h. The same files come out every time. Files named found-* are not from here: a fuzzer found
them.
"""

from __future__ import annotations

import struct
import sys
from pathlib import Path

PROTECT, COUNT, TRANSFER, EVENT = 1, 2, 4, 8
BUS_OFF, BUS_ON, POWER, TEAR_WRITE, ROT = range(5)
TICK, JUMP = 200, 250  # what passes: from here on seconds, or 10 min, 2 h, 1, 6, 23, 40 days; below: milliseconds
GATEWAY, TOOL = 62, 63
ABSENT8, ABSENT16, ABSENT_S16 = 0xFF, 0xFFFF, 0x8000
FUNCTIONS = {
    "emcy": (0x01, 1), "site_limit": (0x02, GATEWAY), "setpoint": (0x03, 1), "evse_status": (0x04, 1),
    "ev_status": (0x05, 1), "evse_elec": (0x06, 1), "site_meter": (0x07, GATEWAY), "time_sync": (0x08, GATEWAY),
    "ctrl_status": (0x09, 0), "ev_param_a": (0x0A, 1), "ev_param_b": (0x0B, 1), "ev_param_c": (0x0C, 1),
    "evse_info": (0x0D, 1), "plan": (0x0E, 1), "ctrl_diag": (0x0F, 0), "ev_param_d": (0x10, 1),
    "ev_param_e": (0x12, 1),
}  # fmt: skip
ISOTP_FROM = 0x19


def record(can_id: int, data: bytes, then: int = 0, flags: int = PROTECT | COUNT, length: int = 8, bus: int = 0) -> bytes:
    """One frame; `then` is what passes after it."""
    nibble = 0 if length == 8 else length + 1
    return struct.pack("<BHB8s", flags | nibble << 4, can_id | bus << 11, then, data)


def frame(name: str, body: bytes, node: int | None = None, nibble: int = 0, **how: int) -> bytes:
    """A protected frame: `nibble` is the high half of byte 1, `body` bytes 2..7."""
    function, default = FUNCTIONS[name]
    return record(function << 6 | (default if node is None else node), bytes([0, nibble << 4]) + body, **how)


def site_limit(hundred_W: int, active: bool = True, validity_s: int = ABSENT8, **how: int) -> bytes:
    body = struct.pack("<hHBB", hundred_W, ABSENT_S16, ABSENT8, validity_s)
    return frame("site_limit", body, nibble=int(active), **how)


def time_sync(unix_s: int, quality: int = 1, **how: int) -> bytes:
    return frame("time_sync", struct.pack("<IH", unix_s, quality << 10), **how)


def evse_status(node: int, pilot: int = 2, present: bool = True, phases: int = 3, fault: bool = False,
                tenths_A: int = 0, **how: int) -> bytes:  # fmt: skip
    bits = sum(tenths_A << shift for shift in (0, 12, 24)) << 16 | fault << 54 | phases << 60 | int(present) << 63
    return frame("evse_status", bits.to_bytes(8, "little")[2:], node, pilot, **how)


def ev_status(node: int, half_percent: int = 100, age_s: int = 0, tenths_A: int = 320, wishes: int = 0x04,
              error: int = 0, **how: int) -> bytes:  # fmt: skip
    body = struct.pack("<BBHBB", half_percent, age_s, tenths_A, ABSENT8, wishes)
    return frame("ev_status", body, node, error, **how)


def evse_elec(node: int, decivolts: int = 2300, ten_W: int = 0, ten_Wh: int = 0, **how: int) -> bytes:
    return frame("evse_elec", struct.pack("<HHH", decivolts, ten_W, ten_Wh), node, **how)


def parameters(node: int, session: int = 7, hundred_Wh: int = 600, departure_min: int = 10120, ten_W: int = 1100,
               wanted: tuple[int, int, int] = (1000, -32768, -32768), revision: int = 7) -> bytes:  # fmt: skip
    a = struct.pack("<BHBBB", session, hundred_Wh, 160, ABSENT8, 80)
    b = struct.pack("<HHBB", departure_min, ten_W, ABSENT8, session)
    c = struct.pack("<hhh", *wanted)
    d = struct.pack("<HB3x", 600, session)
    names = ("ev_param_a", "ev_param_b", "ev_param_c", "ev_param_d")
    return b"".join(frame(name, body, node, revision) for name, body in zip(names, (a, b, c, d)))


def info(node: int, version: int = 1, rotation: int = 1) -> bytes:
    """EVSE_INFO: 32 A, 6 A, AC3."""
    return frame("evse_info", struct.pack("<HBBH", 320, 12, 2 | rotation << 2, 0x0100), node, version)


def vehicle(node: int, **how: int) -> bytes:
    return info(node) + evse_status(node) + parameters(node, **how) + ev_status(node) + evse_elec(node)


def site(hundred_W: int = 500) -> bytes:
    return time_sync(600000) + site_limit(hundred_W)


def charging(seconds: int = 12, node: int = 1, hundred_W: int = 500) -> bytes:
    """A vehicle that charges, second by second."""
    scene = site(hundred_W) + vehicle(node)
    for second in range(seconds):
        scene += site_limit(hundred_W) + ev_status(node) + evse_elec(node, ten_W=1100, ten_Wh=second)
        scene += evse_status(node, tenths_A=160, then=TICK)
    return scene


def edges(name: str) -> bytes:
    """All bytes at an end of their range, one byte at a time and all of them; and a station that must bear it."""
    ends = (0x00, 0x01, 0x7F, 0x80, 0xFE, 0xFF)
    bodies = [bytes([end]) * 6 for end in ends]
    bodies += [bytes(end if k == at else 0 for k in range(6)) for at in range(6) for end in (0x80, 0xFF)]
    scene = site() + vehicle(1) + evse_status(1, then=TICK)
    for k, body in enumerate(bodies):
        scene += frame(name, body, nibble=k % 16, then=100)
    return scene + evse_status(1) + site_limit(400, then=TICK)


def transfer(kind: int, items: bytes, count: int, node: int = GATEWAY, then: int = TICK) -> bytes:
    """Whole transfer: content in the data of the records behind the first. Padded, since records hold eight bytes each."""
    padded = items + bytes(-len(items) % 8)
    parts = [padded[at : at + 8] for at in range(0, len(padded), 8)]
    head = struct.pack("<BBH4x", kind, len(parts), count)
    can_id = ISOTP_FROM << 6 | node
    return record(can_id, head, then, TRANSFER) + b"".join(record(can_id, part, flags=0) for part in parts)


def curve(points: int, step_s: int = 900, start_s: int = 600000) -> bytes:
    return b"".join(struct.pack("<IH", start_s + k * step_s, 400 - 10 * k) for k in range(points))


def price_curve(points: int, step_s: int = 900, start_s: int = 600000) -> bytes:
    return b"".join(struct.pack("<Ih", start_s + k * step_s, 40 - 20 * k) for k in range(points))


def raw_isotp(*frames: str, node: int = GATEWAY) -> bytes:
    return b"".join(record(ISOTP_FROM << 6 | node, bytes.fromhex(text), then=5, flags=0) for text in frames)


def event(what: int, detail: int = 0, copy: int = 0, then: int = 0) -> bytes:
    return record(0, bytes([what, detail, copy]), then, EVENT)


GOLDEN = ("7610a000060c0707", "670f000006000707")


def faults() -> dict[str, bytes]:
    """Rows of the table of faults that begin with a frame."""
    one = charging(3)
    again = charging(9)
    return {
        "soc-stale": one + ev_status(1, age_s=61) + evse_status(1, then=TICK),
        "soc-jump": one + b"".join(ev_status(1, half_percent=190) + evse_status(1, then=TICK) for _ in range(4)),
        "crc-errors": one + b"".join(evse_status(1, then=150, flags=0) for _ in range(6)) + evse_status(1, then=TICK),
        "repeated": one + evse_status(1, then=TICK, flags=PROTECT) * 4,
        "lost": one + b"".join(record(0x101, bytes([0, 0x20 | k % 16, 0, 0, 0, 0, 0, 0xB0]), TICK, PROTECT)
                               for k in (3, 6, 9, 14, 2, 15)),  # fmt: skip
        "masquerade": site() + b"".join(record(0x100 | node, bytes.fromhex(GOLDEN[0]), flags=0) for node in range(4)),
        "lengths": b"".join(evse_status(1, length=length, then=10) for length in range(9)) + site_limit(1, then=TICK),
        "silence": one + evse_status(1, then=TICK + 5) + evse_status(1, then=JUMP) + again,
        "babble": one + evse_status(1, then=1) * 120 + site_limit(500, then=TICK),
        "second-controller": one + frame("setpoint", bytes.fromhex("a000060c0707"), then=TICK) * 2 + again,
        "limit-zero-negative": one + site_limit(0, then=TICK) + site_limit(-1, then=TICK) + site_limit(-32767, then=TICK),
        "limit-flaps": one + b"".join(site_limit(500 * (k % 2), then=TICK) + evse_status(1) for k in range(8)),
        "heartbeat-without-limit": one + site_limit(-32768, then=TICK + 5) + site_limit(-32768, then=TICK) + again,
        "capacity-absurd": site() + b"".join(vehicle(node, hundred_Wh=Wh) for node, Wh in
                                             enumerate((0, 1, 65534, 65535), 1)) + site_limit(500, then=TICK),
        "contradicting-parameters": site() + vehicle(1, wanted=(100, 50, 200)) + vehicle(2, wanted=(-5, -6, 32767))
        + vehicle(3, departure_min=9000) + vehicle(4, ten_W=0) + site_limit(500, then=TICK),
        "over-draw": one + b"".join(evse_status(1, tenths_A=400, then=TICK) for _ in range(12)),
        "replug": one + evse_status(1, pilot=0, present=False, then=TICK) + vehicle(1, session=8, revision=8)
        + evse_status(1, then=TICK) + parameters(1, session=9, revision=9) + evse_status(1, then=TICK),
        "clock-jumps": time_sync(0, 0) + one + b"".join(time_sync(unix_s, then=TICK) for unix_s in
                                                        (1, 2**32 - 1, 600000, 2**31)) + again,
        "clock-wraps": charging(30),
        "long-pause": one + b"".join(evse_status(1, then=JUMP + k) + charging(2) for k in range(6)),
        "bus-off": one + event(BUS_OFF, 2, then=TICK) + charging(4) + event(BUS_OFF, then=TICK + 3) + charging(2)
        + event(BUS_ON) + again,
        "power-fails": one + event(POWER, then=TICK) + again + event(TEAR_WRITE, 7)
        + frame("site_limit", struct.pack("<hhBB", 400, 90, 12, 60), nibble=1, then=JUMP) + charging(1) + event(POWER)
        + charging(2) + event(ROT, 40) + event(ROT, 41, 1) + event(POWER) + charging(2),
        "protocol-version": one + info(1, version=2) + info(1, rotation=0) + info(1, rotation=7) + again,
    }  # fmt: skip


def transfers() -> dict[str, bytes]:
    torn = "1026010105007c00", "21000000000000", "23000000000000", "2400000000000000"
    return {
        "curve": charging(2) + transfer(1, curve(8), 8) + charging(3),
        "curve-out-of-order": charging(2) + transfer(1, curve(4)[::-1], 4) + transfer(1, curve(4), 5),
        "price-curve": charging(2) + transfer(2, price_curve(30), 30) + charging(3) + transfer(2, price_curve(4), 5)
        + transfer(2, b"", 0) + charging(1),
        "identifiers": charging(2) + transfer(3, b"DE*ABC*E1234567*", 16, 1) + transfer(5, b"", 0, TOOL)
        + raw_isotp("3000000000000000", node=TOOL) * 3 + charging(2),
        "isotp-nonsense": charging(1) + raw_isotp(*torn, "1fff010100000000", "30000000000000", "32ffff0000000000",
                                                  "0801020304050607", "0000000000000000", "f000000000000000")
        + raw_isotp("0301020304050607", node=1) + charging(1),
    }  # fmt: skip


EDGES = {
    "gateway": "site_limit site_meter time_sync",
    "evse": "evse_status evse_elec evse_info emcy",
    "ev-status": "ev_status",
    "ev-param": "ev_param_a ev_param_b ev_param_c ev_param_d ev_param_e",
    "controller": "setpoint ctrl_status plan ctrl_diag",
}


def corpus() -> dict[str, bytes]:
    files = {"golden": b"".join(record(0x0C1, bytes.fromhex(text), 10, 0) for text in GOLDEN) + charging(1)}
    files["eight-vehicles"] = site(600) + b"".join(vehicle(node) for node in range(1, 9)) + evse_status(1, then=TICK) * 2
    files |= {f"edges-{group}": b"".join(edges(name) for name in names.split()) for group, names in EDGES.items()}
    return files | faults() | transfers()


def main() -> None:
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in corpus().items():
        (folder / name).write_bytes(content)


if __name__ == "__main__":
    main()
