"""The SocketCAN port, by way of port_probe, against python-can, plain sockets and can-utils."""

import os
import re
import socket
import struct
import time

import can
import pytest
from conftest import PATIENCE_S, medium, program, system, wait_until

ERROR_BUSOFF = socket.CAN_ERR_FLAG | 0x40
ERROR_RESTARTED = socket.CAN_ERR_FLAG | 0x100
ERROR_CONTROLLER = socket.CAN_ERR_FLAG | 0x4
RETRY_S = 0.2  # TAPER_SOCKETCAN_RETRY_MS
SEND_QUEUE = 32  # TAPER_SOCKETCAN_SEND_QUEUE
QUEUE = 4096  # TAPER_SOCKETCAN_QUEUE


def ip(*arguments):
    system("ip", *arguments)


class Probe:
    def __init__(self, running):
        self.running = running
        running.wait_for("^ready$")

    def ask(self, line):
        self.running.say(line)
        return self.running.wait_for("").string

    def take(self):
        """All frames that wait: (bus, id, data, length, age in ms)."""
        self.running.say("take")
        frames = []
        while (line := self.running.wait_for("").string).startswith("frame"):
            bus, identifier, data, length, age_ms = line.split()[1:]
            frames.append((int(bus), int(identifier, 16), data, int(length), int(age_ms)))
        assert line == f"end {len(frames)}"
        return frames

    def ids(self):
        return [frame[1] for frame in self.take()]

    def counters(self, bus=0):
        return {name: int(value) for name, value in re.findall(r"(\w+)=(\d+)", self.ask(f"counters {bus}"))}

    def is_off(self, bus=0):
        return self.ask(f"state {bus}") == "off"


@pytest.fixture
def probe(start):
    def run(*arguments, **variables):
        return Probe(start(program("TAPER_PORT_PROBE"), *arguments, env=os.environ | variables))

    return run


@pytest.fixture
def bus():
    with can.Bus("vcan0", interface="socketcan") as peer:
        yield peer


@pytest.fixture
def raw():
    """Sends a frame as it stands: any flag of the identifier, any length."""
    with socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as peer:
        peer.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, 1)
        peer.bind(("vcan0",))
        yield lambda identifier, data=bytes(8), room=8: peer.send(
            struct.pack(f"=IB3x{room}s", identifier, len(data), data))


@pytest.fixture(autouse=True)
def both_interfaces_are_back():
    yield
    present = {name for _, name in socket.if_nameindex()}
    for name in ("vcan0", "vcan1"):
        if name not in present:
            ip("link", "add", name, "type", "vcan")
        ip("link", "set", name, "mtu", "72", "up")


def message(identifier, data=b""):
    return can.Message(arbitration_id=identifier, data=data, is_extended_id=False)


# ---- Frames


def test_frames_arrive_in_order_with_their_content(probe, bus):
    port = probe("vcan0")
    sent = [(identifier, bytes(range(identifier % 9))) for identifier in range(0, 0x800, 11)]
    for identifier, data in sent:
        bus.send(message(identifier, data))
    assert [frame[:4] for frame in port.take()] == [
        (0, identifier, data.hex() or "-", len(data)) for identifier, data in sent]


def test_frames_sent_reach_other_programs_in_order_but_not_the_sender(probe, bus):
    port = probe("vcan0")
    for identifier in (0x7FF, 0x0, 0x123):
        assert port.ask(f"send 0 {identifier:x} 0102030405060708") == "sent"
    assert port.ask("send 0 124 -") == "sent"
    heard = [bus.recv(PATIENCE_S) for _ in range(4)]
    assert [(one.arbitration_id, bytes(one.data)) for one in heard] == [
        (0x7FF, bytes(range(1, 9))), (0x0, bytes(range(1, 9))), (0x123, bytes(range(1, 9))), (0x124, b"")]
    assert port.take() == []
    assert port.counters()["sent"] == 4


def test_can_utils_see_the_same_frames(probe, start):
    port = probe("vcan0")
    dump = start("stdbuf", "-oL", "candump", "-L", "vcan0,123:7FF")
    wait_until(lambda: port.ask("send 0 123 00") and dump.lines, "the start of candump")
    port.ask("send 0 123 cafe")
    dump.wait_for("vcan0 123#CAFE")
    system("cansend", "vcan0", "0C1#760A00")
    assert [frame[:4] for frame in port.take()] == [(0, 0x0C1, "760a00", 3)]


def test_each_bus_has_its_number(probe, bus):
    port = probe("vcan1,vcan0")
    bus.send(message(0x10))
    with can.Bus("vcan1", interface="socketcan") as other:
        other.send(message(0x20))
        assert port.ask("send 0 30 -") == "sent"
        assert other.recv(PATIENCE_S).arbitration_id == 0x30
    assert sorted(frame[:2] for frame in port.take()) == [(0, 0x20), (1, 0x10)]
    assert bus.recv(0) is None


def test_only_identifiers_of_the_filters_are_received(probe, bus):
    port = probe("vcan0", "100:7c0", "0be:7ff")
    for identifier in (0x0BE, 0x0BF, 0x0FF, 0x100, 0x13F, 0x140):
        bus.send(message(identifier))
    assert port.ids() == [0x0BE, 0x100, 0x13F]
    assert port.counters()["received"] == 3


def test_what_is_filtered_away_does_not_wake_the_program(probe, bus, raw):
    port = probe("vcan0", "100:7ff")
    bus.send(message(0x101))
    raw(socket.CAN_EFF_FLAG | 0x100)
    assert port.ask("wait 0 300") == "silent"
    bus.send(message(0x100))
    assert port.ask(f"wait 0 {1000 * PATIENCE_S}") == "readable"


def test_remote_extended_and_fd_frames_are_passed_over(probe, raw):
    port = probe("vcan0")
    raw(0x1)
    raw(socket.CAN_RTR_FLAG | 0x2)
    raw(socket.CAN_EFF_FLAG | 0x3)
    raw(0x4, bytes(48), room=64)
    raw(0x5)
    assert port.ids() == [0x1, 0x5]


def test_without_any_option_of_the_kernel_the_same_frames_are_received(probe, raw):
    port = probe("vcan0", "001:7fd", "005:7ff", REFUSE_OPTIONS="1")
    raw(0x1)
    raw(socket.CAN_RTR_FLAG | 0x1)
    raw(socket.CAN_EFF_FLAG | 0x1)
    raw(0x3, bytes(48), room=64)
    raw(0x2)
    raw(0x5)
    [first, second] = port.take()
    assert (first[1], second[1]) == (0x1, 0x5)
    assert first[4] < 1000 * PATIENCE_S


# ---- Time


def test_a_frame_read_late_has_the_time_of_its_reception(probe, bus):
    port = probe("vcan0")
    bus.send(message(0x1))
    time.sleep(1.0)
    bus.send(message(0x2))
    time.sleep(0.5)
    ages = [frame[4] for frame in port.take()]
    assert 1500 <= ages[0] < 1500 + 1000 * PATIENCE_S
    assert 500 <= ages[1] <= ages[0] - 900


def test_a_clock_set_forward_makes_no_frame_older_than_the_last_look(probe, bus):
    port = probe("vcan0")
    began = time.monotonic()
    assert port.take() == []
    bus.send(message(0x1))
    assert port.ask("shift 0 1000000") == "shifted"
    [(*_, age_ms)] = port.take()
    assert age_ms <= (time.monotonic() - began) * 1000 + 2  # two clocks, in whole milliseconds


def test_a_clock_set_back_makes_no_frame_of_the_future(probe, bus):
    port = probe("vcan0")
    bus.send(message(0x1))
    assert port.ask("shift 0 -1000000") == "shifted"
    [(*_, age_ms)] = port.take()
    assert age_ms < 1000 * PATIENCE_S


# ---- Errors of the controller


def test_bus_off_stops_sending_until_the_controller_restarts(probe, raw):
    port = probe("vcan0")
    raw(ERROR_BUSOFF)
    assert port.take() == []
    assert port.is_off()
    assert port.ask("send 0 1 -") == "refused"
    raw(ERROR_RESTARTED)
    assert port.take() == []
    assert not port.is_off()
    assert port.ask("send 0 1 -") == "sent"
    assert port.counters() | {"error_frames": 2, "bus_off": 1, "send_refused": 1, "sent": 1} == port.counters()


def test_a_frame_received_ends_bus_off(probe, raw):
    port = probe("vcan0")
    raw(ERROR_BUSOFF)
    port.ask("drain")
    assert port.is_off()
    raw(0x1)
    port.ask("drain")
    assert not port.is_off()


def test_sending_is_tried_again_after_a_restart_was_asked_for(probe, raw):
    port = probe("vcan0")
    raw(ERROR_BUSOFF)
    port.ask("drain")
    assert port.ask("restart 0") == "asked"
    assert not port.is_off()
    assert port.ask("send 0 1 -") == "sent"
    assert port.counters()["restarts"] == 1


def test_other_errors_are_counted_and_change_nothing(probe, raw):
    port = probe("vcan0")
    raw(ERROR_CONTROLLER)
    assert port.take() == []
    assert not port.is_off()
    assert port.counters()["error_frames"] == 1


# ---- The interface


def test_an_interface_that_is_down_refuses_and_comes_back_by_itself(probe):
    port = probe("vcan0")
    ip("link", "set", "vcan0", "down")
    assert port.ask("send 0 1 -") == "refused"
    assert port.is_off()
    ip("link", "set", "vcan0", "up")
    wait_until(lambda: not port.is_off(), "the return of vcan0")
    assert port.ask("send 0 2 -") == "sent"
    system("cansend", "vcan0", "003#")
    assert port.ids() == [0x3]
    assert port.counters() | {"downs": 1, "send_refused": 1, "sent": 1} == port.counters()


def test_an_interface_that_goes_down_is_noticed_by_receiving_too(probe):
    port = probe("vcan0")
    ip("link", "set", "vcan0", "down")
    assert port.take() == []
    assert port.is_off()


def test_an_interface_made_anew_is_taken_up_with_its_filters(probe):
    port = probe("vcan0", "100:700")
    ip("link", "del", "vcan0")
    assert port.take() == []
    assert port.is_off()
    time.sleep(2 * RETRY_S)
    assert port.is_off()
    ip("link", "add", "vcan0", "type", "vcan")
    assert port.is_off()
    ip("link", "set", "vcan0", "up")
    wait_until(lambda: not port.is_off(), "the return of vcan0")
    with can.Bus("vcan0", interface="socketcan") as bus:
        for identifier in (0x200, 0x101):
            bus.send(message(identifier))
        assert port.ask(f"wait 0 {1000 * PATIENCE_S}") == "readable"
        assert port.ids() == [0x101]
        assert port.ask("send 0 2 -") == "sent"
        assert bus.recv(PATIENCE_S).arbitration_id == 0x2


def test_one_interface_down_leaves_the_other_alone(probe, bus):
    port = probe("vcan0,vcan1")
    ip("link", "set", "vcan1", "down")
    port.ask("drain")
    bus.send(message(0x1))
    assert (port.is_off(0), port.is_off(1)) == (False, True)
    assert port.ids() == [0x1]


def test_an_interface_may_be_down_at_the_start(probe):
    ip("link", "set", "vcan0", "down")
    port = probe("vcan0")
    assert port.ask("send 0 1 -") == "refused"
    ip("link", "set", "vcan0", "up")
    wait_until(lambda: port.ask("send 0 1 -") == "sent", "sending")


@pytest.mark.parametrize("name", ["nocan0", "much-too-long-for-a-name"])
def test_an_unknown_interface_is_named_with_what_to_do(start, name):
    failed = start(program("TAPER_PORT_PROBE"), f"vcan0,{name}")
    failed.wait_for(f"^port_probe: {name}: no such interface; .*tools/with-vcan")
    assert failed.finish() == 1


def test_an_interface_that_is_no_can_is_refused(start):
    failed = start(program("TAPER_PORT_PROBE"), "lo")
    failed.wait_for("^port_probe: lo: not a CAN interface")
    assert failed.finish() == 1


# ---- Queues that are full


def numbers(frames):
    return [int.from_bytes(bytes.fromhex(frame[2]), "little") for frame in frames]


def fill(sender, receiver, count, chunk=200):
    """Send `count` numbered frames. The receiver fetches them between chunks that its socket has room for."""
    for _ in range(count // chunk):
        assert sender.ask(f"flood 0 {chunk}") == f"sent {chunk}"
        receiver.ask("drain")


def test_a_full_queue_drops_its_oldest_and_counts(probe):
    port, sender = probe("vcan0"), probe("vcan0")
    extra = 104
    fill(sender, port, QUEUE + extra)
    frames = port.take()
    assert len(frames) == QUEUE
    assert numbers(frames)[-200:] == list(range(200))
    assert numbers(frames)[0] == extra
    assert port.counters() | {"queue_drops": extra, "kernel_drops": 0} == port.counters()
    assert port.ask("overflows 0") == str(extra)


def test_what_the_kernel_drops_is_counted(probe):
    port, sender = probe("vcan0"), probe("vcan0")
    assert sender.ask("flood 0 20000") == "sent 20000"
    kept = len(port.take())
    assert kept < 20000
    assert sender.ask("flood 0 2") == "sent 2"  # the kernel tells its count, of all so far, with each further frame
    kept += len(port.take())
    assert port.counters()["kernel_drops"] == 20002 - kept - port.counters()["queue_drops"]
    assert int(port.ask("overflows 0")) == 20002 - kept


def test_a_slow_bus_refuses_frames_instead_of_making_them_old(probe, bus):
    port = probe("vcan0")
    with medium("tbf", "rate", "2kbit", "burst", "100", "limit", "1mb"):
        accepted = int(port.ask("flood 0 500").split()[1])
        assert SEND_QUEUE / 2 <= accepted <= SEND_QUEUE * 4
        assert port.counters()["send_refused"] == 500 - accepted
        assert all(bus.recv(PATIENCE_S) for _ in range(accepted))
        assert port.ask("send 0 1 -") == "sent"


def test_a_full_queue_of_the_interface_refuses_frames(probe):
    port = probe("vcan0")
    with medium("netem", "delay", "100s", "limit", "10"):
        assert port.ask("flood 0 15") == "sent 10"
    assert port.counters() | {"sent": 10, "send_refused": 5} == port.counters()
    assert not port.is_off()


# ---- Wrong calls


@pytest.mark.parametrize("call", ["send 1 1 -", "send 0 800 -"], ids=["no such bus", "no such identifier"])
def test_what_cannot_be_sent_is_refused(probe, bus, call):
    assert probe("vcan0").ask(call) == "refused"
    assert bus.recv(0.1) is None


def test_a_bus_that_is_not_there_is_off(probe):
    assert probe("vcan0").is_off(1)
