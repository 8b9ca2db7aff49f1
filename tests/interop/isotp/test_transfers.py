"""Transfers made in Python, by docs/transfers.md alone, to the station's end of them."""

from __future__ import annotations

import binascii
import re
import struct
import time
from pathlib import Path

import pytest
from conftest import INTERFACE, other_end, running, transfer

ACCEPTED, CRC, VERSION, CONTENT = 0, 1, 2, 3
LIMIT_CURVE, PRICE_CURVE, IDENTIFIER, LOG_REQUEST, LOG, ANSWER = 1, 2, 3, 5, 6, 7


def end_of(node: int):
    return other_end(0x640 | node, 0x600 | node)


def curve(points: list[tuple[int, int]]) -> bytes:
    """(Unix time [s], limit [100 W])."""
    return transfer(LIMIT_CURVE, len(points), b"".join(struct.pack("<IH", *point) for point in points))


def price_curve(points: list[tuple[int, int]]) -> bytes:
    """(Unix time [s], price [1/1000 per kWh])."""
    return transfer(PRICE_CURVE, len(points), b"".join(struct.pack("<Ih", *point) for point in points))


def answer(code: int) -> bytes:
    return transfer(ANSWER, 1, bytes([code]))


@pytest.mark.parametrize("count", (1, 96, 384))
def test_a_limit_curve_arrives_point_by_point(count: int) -> None:
    start = int(time.time()) + 1000
    points = [(start + 900 * k, k * 7) for k in range(count)]
    with running("transfers") as peer, end_of(62) as gateway:
        gateway.send(curve(points))
        assert gateway.receive() == answer(ACCEPTED)
        words = peer.line().split()
    assert words[:2] == ["curve", str(count)]
    for word, (unix_s, limit) in zip(words[2:], points, strict=True):
        at_s, watts = map(int, word.split(":"))
        assert abs(at_s - unix_s) <= 1 and watts == 100 * limit


@pytest.mark.parametrize("count", (1, 200))
def test_a_price_curve_arrives_point_by_point(count: int) -> None:
    start = int(time.time()) + 1000
    points = [(start + 900 * k, 40 - k) for k in range(count)]
    with running("transfers") as peer, end_of(62) as gateway:
        gateway.send(price_curve(points))
        assert gateway.receive() == answer(ACCEPTED)
        words = peer.line().split()
    assert words[:2] == ["price", str(count)]
    for word, (unix_s, price) in zip(words[2:], points, strict=True):
        at_s, milli = map(int, word.split(":"))
        assert abs(at_s - unix_s) <= 1 and milli == price


def test_a_price_that_is_absent_is_refused() -> None:
    with running("transfers") as peer, end_of(62) as gateway:
        gateway.send(price_curve([(int(time.time()), -0x8000)]))
        assert gateway.receive() == answer(CONTENT)
        assert peer.line() == "refused"


def test_the_example_of_the_document_works(capsys: pytest.CaptureFixture[str]) -> None:
    text = (Path(__file__).parents[3] / "docs" / "transfers.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert example.count('"can0"') == 1
    with running("transfers") as peer:
        exec(compile(example.replace('"can0"', f'"{INTERFACE}"'), "docs/transfers.md", "exec"), {})  # noqa: S102
        assert [word.rsplit(":")[-1] for word in peer.line().split()[2:]] == ["11000", "4200", "22000"]
    assert capsys.readouterr().out == "accepted\n"


def test_what_is_wrong_with_a_curve_is_told() -> None:
    start = int(time.time()) + 1000
    good = curve([(start, 1), (start + 1, 2)])
    newer = bytes([2]) + good[1:-4]
    with running("transfers") as peer, end_of(62) as gateway:
        for message, code in ((good[:-1] + bytes([good[-1] ^ 1]), CRC),
                              (newer + struct.pack("<I", binascii.crc32(newer)), VERSION),
                              (curve([(start, 1), (start, 2)]), CONTENT)):
            gateway.send(message)
            assert gateway.receive() == answer(code)
            assert peer.line() == "refused"
        gateway.send(good)
        assert gateway.receive() == answer(ACCEPTED)


def test_an_identifier_arrives() -> None:
    with running("transfers") as peer, end_of(1) as connector:
        connector.send(transfer(IDENTIFIER, 14, b"DE*ABC*E123456"))
        assert connector.receive() == answer(ACCEPTED)
        assert peer.line() == "identifier 0 DE*ABC*E123456"


def test_the_log_is_read() -> None:
    with running("transfers"), end_of(63) as tool:
        tool.send(transfer(LOG_REQUEST, 0, b""))
        log = tool.receive()
    version, kind, count = struct.unpack_from("<BBH", log)
    assert (version, kind, count) == (1, LOG, 3)
    assert struct.unpack("<I", log[-4:]) == (binascii.crc32(log[:-4]),)
    assert list(struct.iter_unpack("<IIiBBBB", log[4:-4])) == [
        (1, 0, 0, 1, 0, 0, 0),
        (70000, 1700000000, -7, 16, 0, 0, 0),
        (4000000000, 4000000000, 9, 22, 0, 1, 0),
    ]
