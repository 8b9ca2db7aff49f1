#!/usr/bin/env python3
"""A second reading of docs/protocol.md: plays connectors on a CAN interface, and audits every frame on it.

It shares no code with the firmware or the tools: the DBC is all that both have. At every frame it adds up what each
connector on the bus may draw, and holds the sum against the limit in force. Exit code: 0 all well; 1 a limit could have
been exceeded, or the end-to-end protection found an error; 2 wrong usage, or the interface cannot be used.
"""

import argparse
import errno
import json
import sys
import time
from pathlib import Path

import can

from peer.account import Account, Limit
from peer.connector import PERIODS_S, Connector
from peer.gateway import SITE_LIMIT, TIME_SYNC, Gateway
from peer.observer import ERRORS, Observer
from peer.vehicle import default_visits, read_visits
from peer.wire import GATEWAY_NODE, Wire, self_check

ROOT = Path(__file__).resolve().parents[2]
EPOCH_UNIX_S = 1_772_323_200  # 2026-03-01, midnight UTC: where the own gateway's clock begins
STEP_S = 0.02
LONGEST_REST_S = 0.5  # to send what a full queue refused
SENT_BY_US = {*PERIODS_S, SITE_LIMIT, TIME_SYNC}
EXIT_VIOLATION, EXIT_USAGE = 1, 2


def _nodes(text: str) -> list[int]:
    try:
        nodes = [int(part) for part in text.split(",") if part]
    except ValueError:
        nodes = [0]
    if any(not 1 <= node <= 60 for node in nodes) or len(set(nodes)) != len(nodes):
        raise argparse.ArgumentTypeError(f"'{text}' is not a list of different nodes 1..60, such as 1,2,3")
    return nodes


def _schedule(text: str) -> list[tuple[float, float]]:
    try:
        pairs = [part.split(":") for part in text.split(",")]
        points = [(float(pair[0]) if len(pair) > 1 else 0.0, float(pair[-1]) * 1000) for pair in pairs]
    except ValueError:
        points = []
    if not points or points != sorted(points, key=lambda point: point[0]):
        raise argparse.ArgumentTypeError(f"'{text}' is neither a limit [kW] nor a schedule such as 0:40,20:15")
    return points


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--can", default="vcan0", help="SocketCAN interface (default vcan0)")
    parser.add_argument("--dbc", type=Path, default=ROOT / "codegen/taper.dbc", help="CAN database")
    parser.add_argument("--nodes", type=_nodes, default=[1, 2, 3], help="connectors to play (default 1,2,3; '' none)")
    parser.add_argument("--seconds", type=float, default=60.0, help="how long, in seconds of the bus (default 60)")
    parser.add_argument("--time-scale", type=float, default=1.0, help="batteries and wall clock run so much faster")
    parser.add_argument("--vehicles", type=Path, help="sessions CSV; times count from the start (default: three kinds)")
    parser.add_argument("--station-limit-kw", type=float, default=110.0, help="of the wiring (default 110)")
    parser.add_argument("--failsafe-kw", type=float, default=11.0, help="while the gateway is silent (default 11)")
    parser.add_argument("--grace-ms", type=float, default=2000.0, help="time to follow a falling limit (default 2000)")
    parser.add_argument("--gateway", action="store_true", help="play the gateway too")
    parser.add_argument("--limit-kw", type=_schedule, default=[(0.0, 40_000.0)],
                        help="what the own gateway says: kW, or BUS_SECOND:kW,... (default 40)")
    parser.add_argument("--report", type=Path, help="JSON report (default: standard output)")
    return parser


class Program:
    def __init__(self, options: argparse.Namespace, bus: can.BusABC, wire: Wire):
        self.options, self.bus, self.wire = options, bus, wire
        station_W, failsafe_W = options.station_limit_kw * 1000, options.failsafe_kw * 1000
        self.observer = Observer(wire, Account(Limit(station_W, failsafe_W, options.grace_ms / 1000)))
        world_s = options.seconds * options.time_scale
        self.visits = (read_visits(options.vehicles, options.nodes) if options.vehicles
                       else default_visits(options.nodes, world_s))
        self.connectors = {node: Connector(node, [visit for visit in self.visits if visit.node == node])
                           for node in options.nodes}
        self.gateway = Gateway(options.limit_kw, failsafe_W) if options.gateway else None
        self.played = set(options.nodes) | ({GATEWAY_NODE} if options.gateway else set())
        self.refused: dict[int, int] = dict.fromkeys(options.nodes, 0)
        self.foreign = self.error_frames = self.sent = self.send_retries = 0
        self.start_s = time.time()
        self.world_zero_unix_s: float | None = EPOCH_UNIX_S if options.gateway else None

    def run(self) -> None:
        end_s = self.start_s + self.options.seconds
        step_s = self.start_s
        while (now_s := time.time()) < end_s:
            if now_s >= step_s:
                self._step(now_s)
                step_s = max(step_s + STEP_S, now_s)
            message = self.bus.recv(max(min(step_s, end_s) - time.time(), 0.0))
            if message is not None:
                self._hear(message)
        while (message := self.bus.recv(0.05)) is not None and message.timestamp < end_s:
            self._hear(message)

    def _hear(self, message: can.Message) -> None:
        if message.is_error_frame:
            self.error_frames += 1
            return
        if message.is_extended_id or message.is_remote_frame:
            return  # not of this bus
        can_id, data, now_s = message.arbitration_id, bytes(message.data), message.timestamp
        used = self.observer.hear(now_s, can_id, data)
        if used is None:
            return
        name, node = used
        if name == "SETPOINT" and node in self.connectors:
            accepted = self.connectors[node].on_setpoint(now_s, self.wire, data)
            self.refused[node] += not accepted
            self._send(self.connectors[node].due(self.wire, now_s))
        elif message.is_rx and node in self.played and name in SENT_BY_US:
            self.foreign += 1
        elif name == TIME_SYNC and self.gateway is None:
            self._set_clock(now_s, data)

    def _set_clock(self, now_s: float, data: bytes) -> None:
        unix_s, millisecond, quality = self.wire.read("TIME_SYNC", data, "unix_time", "millisecond", "quality")
        if quality and millisecond is not None:
            world_s = (now_s - self.start_s) * self.options.time_scale
            self.world_zero_unix_s = unix_s + millisecond / 1000 - world_s

    def _step(self, now_s: float) -> None:
        since_s = now_s - self.start_s
        world_s = since_s * self.options.time_scale
        for connector in self.connectors.values():
            connector.step(now_s, world_s, self.options.time_scale, self.world_zero_unix_s)
            self._send(connector.due(self.wire, now_s))
        if self.gateway:
            self._send(self.gateway.due(self.wire, now_s, since_s, EPOCH_UNIX_S + world_s))

    def _send(self, frames: list[tuple[int, bytes]]) -> None:
        for can_id, data in frames:
            message = can.Message(arbitration_id=can_id, data=data, is_extended_id=False)
            give_up_s = time.monotonic() + LONGEST_REST_S
            while not self._sent(message, give_up_s):
                time.sleep(0.001)

    def _sent(self, message: can.Message, give_up_s: float) -> bool:
        try:
            self.bus.send(message)
        except can.CanOperationError as error:
            if error.error_code != errno.ENOBUFS or time.monotonic() > give_up_s:
                raise
            self.send_retries += 1
            return False
        self.sent += 1
        return True

    def report(self) -> dict:
        observer = self.observer
        origin_s = observer.first_s or self.start_s
        violations = observer.account.violations_as_dicts(origin_s)
        errors = sum(observer.e2e[kind] for kind in ERRORS)
        margin_W = observer.account.worst_margin_W
        return {
            "ok": not violations and not errors and not self.foreign,
            "seconds": self.options.seconds, "time_scale": self.options.time_scale,
            "first_frame_s": observer.first_s, "last_frame_s": observer.last_s,
            "frames": {"all": sum(observer.frames.values()), "sent": self.sent, "error_frames": self.error_frames,
                       "send_retries": self.send_retries, "by_message": dict(sorted(observer.frames.items()))},
            "e2e": dict(observer.e2e), "e2e_errors": observer.errors,
            "frames_of_somebody_else_as_us": self.foreign,
            "setpoints": dict(sorted(observer.setpoints.items())), "setpoints_refused": self.refused,
            "sessions": [visit.report() for visit in self.visits],
            "energy_kwh": round(sum(visit.energy_kwh for visit in self.visits), 3),
            "worst_margin_W": None if margin_W == float("inf") else round(margin_W, 1),
            "violations": violations,
        }


def _open(interface: str) -> can.BusABC:
    """The bus, with our own frames in it: what is audited is the bus in its order, whoever sends."""
    return can.Bus(interface="socketcan", channel=interface, receive_own_messages=True)


def main(arguments: list[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    self_check()
    try:
        bus = _open(options.can)
    except OSError as error:
        print(f"independent.py: {options.can}: {error.strerror}; make one with: sudo ip link add dev {options.can} "
              f"type vcan && sudo ip link set {options.can} up", file=sys.stderr)
        return EXIT_USAGE
    with bus:
        program = Program(options, bus, Wire(str(options.dbc)))
        print(f"independent.py: on {options.can}", file=sys.stderr, flush=True)
        program.run()
    report = program.report()
    text = json.dumps(report, indent=1) + "\n"
    if options.report:
        options.report.write_text(text)
    else:
        print(text, end="")
    for violation in report["violations"][:5]:
        print(f"independent.py: at {violation['begin_s']} s: {violation['excess_W']} W above "
              f"{violation['allowed_W']} W {violation['reason']}", file=sys.stderr)
    return 0 if report["ok"] else EXIT_VIOLATION


if __name__ == "__main__":
    sys.exit(main())
