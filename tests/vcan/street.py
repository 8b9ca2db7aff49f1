"""A gateway and connectors with vehicles on a CAN interface, at their nominal rates: partners for the station."""

import random
import socket
import struct
import threading
import time

FRAME = struct.Struct("=IB3x8s")
WIRE_CRC = [0] * 256
for _value in range(256):
    _crc = _value
    for _ in range(8):
        _crc = (_crc << 1 ^ 0x2F if _crc & 0x80 else _crc << 1) & 0xFF
    WIRE_CRC[_value] = _crc

EMCY, SITE_LIMIT, SETPOINT, EVSE_STATUS, EV_STATUS, EVSE_ELEC, SITE_METER, TIME_SYNC, CTRL_STATUS = range(1, 10)
EV_PARAM_A, EV_PARAM_B, EV_PARAM_C, EVSE_INFO, PLAN = range(10, 15)
OUTLOOK = 17
GATEWAY = 62
PAUSE, CHARGE = 0, 1


def data_id(identifier, counter):
    x = identifier << 4 | counter
    x ^= x >> 7
    x = x * 0x9E3779B1 & 0xFFFFFFFF
    x ^= x >> 15
    x = x * 0x85EBCA6B & 0xFFFFFFFF
    x ^= x >> 13
    return x >> 24


def crc(identifier, data):
    """CRC-8/8H2F of bytes 1..7 and the frame's entry in the DataIDList."""
    value = 0xFF
    for byte in (*data[1:8], data_id(identifier, data[1] & 15)):
        value = WIRE_CRC[value ^ byte]
    return value ^ 0xFF


def is_sound(identifier, data):
    return len(data) == 8 and data[0] == crc(identifier, data)


def bits(data, first, count):
    """An unsigned field of a frame."""
    return int.from_bytes(data, "little") >> first & (1 << count) - 1


class Bus:
    """A raw CAN socket that protects what it sends."""

    def __init__(self, interface):
        self.socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self.socket.bind((interface,))
        self.counters = {}

    def send(self, function, node, *fields):
        """fields: (first bit, value)."""
        identifier = function << 6 | node
        counter = self.counters.get(identifier, 0)
        self.counters[identifier] = (counter + 1) % 16
        value = counter << 8
        for first, field in fields:
            value |= field << first
        data = bytearray(value.to_bytes(8, "little"))
        data[0] = crc(identifier, data)
        self.socket.send(FRAME.pack(identifier, 8, bytes(data)))

    def receive(self, timeout_s):
        """(identifier, data), or None after a while without."""
        self.socket.settimeout(max(timeout_s, 0.001))
        try:
            identifier, length, data = FRAME.unpack(self.socket.recv(FRAME.size))
        except TimeoutError:
            return None
        return identifier, data[:length]

    def close(self):
        self.socket.close()


class Connector:
    """A three-phase connector and its vehicle, which takes what it is told after a second."""

    def __init__(self, node, chance):
        self.node = node
        self.present = True
        self.session = node
        self.revision = 1
        self.stored_wh = 40000 * chance.uniform(0.2, 0.6)
        self.charged_wh = 0.0
        self.told_da = 0  # current of the last setpoint [0.1 A]
        self.fallback_da = 0  # and the fallback current that it gave
        self.current_da = 0
        self.echo = 0

    def hear(self, data):
        self.told_da = bits(data, 16, 16) if bits(data, 12, 4) == CHARGE else 0
        self.fallback_da = bits(data, 40, 8) * 5
        self.echo = data[1] & 15

    def move(self, seconds):
        """`seconds` of the vehicle's time."""
        self.current_da = min(self.told_da, 320) if self.present else 0
        energy_wh = self.current_da / 10 * 690 * seconds / 3600
        self.stored_wh = min(self.stored_wh + energy_wh, 40000)
        self.charged_wh += energy_wh

    def replug(self):
        """Away, or back with another session."""
        self.present = not self.present
        if self.present:
            self.session = self.session % 250 + 1
            self.revision = (self.revision + 1) % 16
            self.charged_wh = 0.0

    def soc(self):
        return round(self.stored_wh / 40000 * 200)


class Street:
    """All of them on one interface, in a thread, until close()."""

    def __init__(self, interface, connectors, limit_w=60000, scale=1, seed=1):
        self.chance = random.Random(seed)
        self.bus = Bus(interface)
        self.limit_w = limit_w
        self.scale = scale
        self.silent = False  # the gateway
        self.connectors = [Connector(node, self.chance) for node in range(1, connectors + 1)]
        self.replugs = False
        self.start = time.monotonic()
        self.wall = 1_790_000_000
        self.ended = threading.Event()
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def _status(self, one):
        pilot = 2 if one.present and one.told_da else 1 if one.present else 0
        current = one.current_da
        self.bus.send(EVSE_STATUS, one.node, (12, pilot), (16, current), (28, current), (40, current),
                      (52, int(current > 0)), (53, int(one.present)), (56, one.echo), (60, 3), (63, int(one.present)))

    def _ev(self, one):
        if one.present:
            self.bus.send(EV_STATUS, one.node, (16, one.soc()), (24, 0), (32, 320), (48, 0xFF), (58, 1), (60, 1))

    def _meter(self, one):
        one.move(self.scale)
        power = round(one.current_da / 10 * 690 / 10)
        self.bus.send(EVSE_ELEC, one.node, (16, 2300), (32, power), (48, min(round(one.charged_wh / 10), 0xFFFE)))

    def _parameters(self, one):
        if one.present:
            revision = (12, one.revision)
            departs = (self.wall // 60 + 240) % 65535
            self.bus.send(EV_PARAM_A, one.node, revision, (16, one.session), (24, 400), (40, 180), (48, 0xFF),
                          (56, 0xFF))
            self.bus.send(EV_PARAM_B, one.node, revision, (16, departs), (32, 2200), (48, 12), (56, one.session))
            self.bus.send(EV_PARAM_C, one.node, revision, (16, 0x8000), (32, 0x8000), (48, 0x8000))

    def _gateway(self, now):
        if not self.silent:
            self.bus.send(SITE_LIMIT, GATEWAY, (12, 1), (13, 1), (16, self.limit_w // 100), (32, 110), (48, 0xFF),
                          (56, 5))
            self.bus.send(TIME_SYNC, GATEWAY, (16, self.wall + int(now * self.scale)), (58, 1))
            self.bus.send(SITE_METER, GATEWAY, (16, 20), (32, 20), (48, 20))

    def _cycle(self, k):
        """What is due in 100 ms number k; the nodes take turns."""
        for one in self.connectors:
            turn = k + one.node
            if turn % 2 == 0:
                self._status(one)
            if turn % 5 == 0:
                self._ev(one)
            if turn % 10 == 0:
                self._meter(one)
            if turn % 20 == 0:
                self._parameters(one)
        if k % 10 == 0:
            self._gateway(k / 10)
            if self.replugs and self.chance.random() < 0.2:
                self.chance.choice(self.connectors).replug()
            if self.replugs and self.chance.random() < 0.1:
                self.limit_w = self.chance.choice((20000, 40000, 60000))

    def _run(self):
        k = 0
        while not self.ended.is_set():
            left = self.start + k * 0.1 - time.monotonic()
            if left <= 0:
                self._cycle(k)
                k += 1
            elif heard := self.bus.receive(left):
                self._hear(*heard)

    def _hear(self, identifier, data):
        node = (identifier & 63) - 1
        if identifier >> 6 == SETPOINT and 0 <= node < len(self.connectors) and is_sound(identifier, data):
            self.connectors[node].hear(data)

    def close(self):
        self.ended.set()
        self.thread.join(5)
        self.bus.close()
