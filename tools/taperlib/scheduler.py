"""libtaper_scheduler.so for Python: Taper as a scheduling algorithm (host_sim/scheduler/README.md).

The structures below are those of host_sim/scheduler/include/taper_scheduler.h, which says what every field means. Units stand
in the names. Errors of calls are `SchedulerError`, with the library's words.
"""

from __future__ import annotations

import ctypes
import enum
from collections.abc import Sequence
from ctypes import POINTER, Structure, byref, c_char_p, c_double, c_int32, c_uint64, c_void_p
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from taperlib.files import InputError

ROOT = Path(__file__).resolve().parents[2]
DEFAULT_LIBRARY = ROOT / "build/host-release/host_sim/scheduler/libtaper_scheduler.so"
VERSION = 1  # TAPER_SCHEDULER_VERSION
POLICIES = {"soc-mpc": 0, "edf-soc": 1}
OBJECTIVES = {"throughput": 0, "log-utility": 1}


class SchedulerError(Exception):
    """A call that the library refused, and why."""


class Why(enum.IntEnum):
    """Why a connector has its current: taper_scheduler_why_t."""

    NO_VEHICLE = 0
    VEHICLE_LIMIT = 1
    CONNECTOR_LIMIT = 2
    LIMIT = 3
    WAITING = 4
    PLANNED = 5


class _Options(Structure):
    _fields_ = [("policy", c_int32), ("period_s", c_int32), ("objective", c_int32), ("outer_iterations", c_int32),
                ("horizon_steps", c_int32), ("fill", c_int32), ("lambda_per_kWh2", c_double)]


class Connector(Structure):
    """A connector: innermost group, lines as bits, between two lines or not, currents and voltage."""

    _fields_ = [("group", c_int32), ("lines", c_int32), ("between", c_int32), ("min_A", c_double), ("max_A", c_double),
                ("voltage_V", c_double)]


class Group(Structure):
    """Limits of a group; 0 is none, and to set leaves one as it is."""

    _fields_ = [("parent", c_int32), ("limit_kW", c_double), ("line_A", c_double), ("delta_A", c_double)]


class _Vehicle(Structure):
    _fields_ = [("session", c_uint64), ("need_kWh", c_double), ("departs_s", c_double), ("max_kW", c_double),
                ("max_A", c_double), ("capacity_kWh", c_double), ("stored_kWh", c_double), ("peak_kW", c_double),
                ("taper_kW", c_double)]


class _Point(Structure):
    _fields_ = [("time_s", c_double), ("limit_kW", c_double)]


class _Current(Structure):
    _fields_ = [("current_A", c_double), ("wish_kW", c_double), ("why", c_int32)]


class Account(Structure):
    """How the last answer came about."""

    _fields_ = [("planned", c_int32), ("verdict", c_int32), ("iterations", c_int32), ("lowered", c_int32)]


@dataclass(frozen=True)
class Vehicle:
    """What is known of a vehicle. 0 is "not known", but for `need_kwh`."""

    session: int
    need_kwh: float
    departs_s: float
    max_kw: float = 0.0
    max_a: float = 0.0
    capacity_kwh: float = 0.0
    stored_kwh: float = 0.0
    peak_kw: float = 0.0
    taper_kw: float = 0.0


@dataclass(frozen=True)
class Current:
    """The answer for one connector."""

    current_a: float
    wish_kw: float
    why: Why


def _load(path: Path) -> ctypes.CDLL:
    try:
        library = ctypes.CDLL(str(path))
    except OSError as error:
        raise InputError(f"{path}: cannot be loaded: {error}; tools/dev build makes it") from None
    handle = c_void_p
    prototypes = {
        "version": (c_int32, []),
        "station_name": (c_char_p, [c_int32]),
        "status_text": (c_char_p, [c_int32]),
        "defaults": (None, [POINTER(_Options)]),
        "open": (c_int32, [POINTER(handle), c_char_p, POINTER(_Options)]),
        "close": (None, [handle]),
        "connectors": (c_int32, [handle]),
        "groups": (c_int32, [handle]),
        "connector": (c_int32, [handle, c_int32, POINTER(Connector)]),
        "group": (c_int32, [handle, c_int32, POINTER(Group)]),
        "set_group": (c_int32, [handle, c_int32, POINTER(Group)]),
        "set_rates": (c_int32, [handle, c_int32, POINTER(c_double), c_int32, c_int32]),
        "set_vehicle": (c_int32, [handle, c_int32, POINTER(_Vehicle)]),
        "set_limit": (c_int32, [handle, c_double]),
        "set_course": (c_int32, [handle, POINTER(_Point), c_int32]),
        "plan": (c_int32, [handle, c_double, POINTER(_Current)]),
        "account": (None, [handle, POINTER(Account)]),
        "holds": (c_int32, [handle, POINTER(c_double)]),
    }
    for name, (result, arguments) in prototypes.items():
        call = getattr(library, f"taper_scheduler_{name}")
        call.restype, call.argtypes = result, arguments
    if library.taper_scheduler_version() != VERSION:
        raise InputError(f"{path}: is of version {library.taper_scheduler_version()}, this binding of {VERSION}")
    return library


def _reals(values: Sequence[float]) -> ctypes.Array[c_double]:
    return (c_double * len(values))(*values)


class Scheduler:
    """An open station. Use it as a context manager, or close it: a process can have it once."""

    def __init__(self, station: str, *, policy: str = "soc-mpc", period_s: int = 300, objective: str = "throughput",
                 lambda_per_kwh2: float = 0.0, outer_iterations: int = 0, horizon_steps: int = 0, fill: bool = True,
                 library: Path = DEFAULT_LIBRARY) -> None:
        self._library = _load(library)
        self._handle = c_void_p()
        options = _Options(POLICIES[policy], period_s, OBJECTIVES[objective], outer_iterations, horizon_steps, int(fill),
                           lambda_per_kwh2)
        self._check(self._library.taper_scheduler_open(byref(self._handle), station.encode(), byref(options)), station)
        self.connectors = [self._describe("connector", i, Connector()) for i in range(self._count("connectors"))]
        self.groups = [self._describe("group", k, Group()) for k in range(self._count("groups"))]

    def __enter__(self) -> Scheduler:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        self._library.taper_scheduler_close(self._handle)
        self._handle = c_void_p()

    def set_group(self, group: int, *, limit_kw: float = 0.0, line_a: float = 0.0, delta_a: float = 0.0) -> None:
        limits = Group(0, limit_kw, line_a, delta_a)
        self._check(self._library.taper_scheduler_set_group(self._handle, group, byref(limits)), f"group {group}")
        self.groups[group] = self._describe("group", group, Group())

    def set_rates(self, connector: int, rates_a: Sequence[float], *, continuous: bool) -> None:
        status = self._library.taper_scheduler_set_rates(self._handle, connector, _reals(rates_a), len(rates_a), continuous)
        self._check(status, f"connector {connector}: rates")
        self.connectors[connector] = self._describe("connector", connector, Connector())

    def set_vehicle(self, connector: int, vehicle: Vehicle | None) -> None:
        told = None
        if vehicle is not None:
            told = byref(_Vehicle(vehicle.session, vehicle.need_kwh, vehicle.departs_s, vehicle.max_kw, vehicle.max_a,
                                  vehicle.capacity_kwh, vehicle.stored_kwh, vehicle.peak_kw, vehicle.taper_kw))
        status = self._library.taper_scheduler_set_vehicle(self._handle, connector, told)
        self._check(status, f"connector {connector}: {vehicle}")

    def set_limit(self, limit_kw: float) -> None:
        self._check(self._library.taper_scheduler_set_limit(self._handle, limit_kw), f"limit {limit_kw} kW")

    def set_course(self, points: Sequence[tuple[float, float]]) -> None:
        """The known course of the limit: (time [s], limit [kW]), ascending."""
        course = (_Point * len(points))(*points)
        self._check(self._library.taper_scheduler_set_course(self._handle, course, len(points)), "course")

    def plan(self, now_s: float) -> list[Current]:
        """The currents of the period that begins now, one for each connector."""
        answer = (_Current * len(self.connectors))()
        self._check(self._library.taper_scheduler_plan(self._handle, now_s, answer), f"time {now_s} s")
        return [Current(one.current_A, one.wish_kW, Why(one.why)) for one in answer]

    def account(self) -> Account:
        account = Account()
        self._library.taper_scheduler_account(self._handle, byref(account))
        return account

    def holds(self, currents_a: Sequence[float]) -> bool:
        """Whether the limits of all groups hold for these currents, one for each connector."""
        if len(currents_a) != len(self.connectors):
            raise SchedulerError(f"{len(currents_a)} currents for {len(self.connectors)} connectors")
        answer = self._library.taper_scheduler_holds(self._handle, _reals(currents_a))
        self._check(min(answer, 0), "currents")
        return answer == 1

    def _count(self, what: str) -> int:
        return getattr(self._library, f"taper_scheduler_{what}")(self._handle)

    def _describe(self, what: str, index: int, description: Connector | Group) -> Connector | Group:
        self._check(getattr(self._library, f"taper_scheduler_{what}")(self._handle, index, byref(description)), what)
        return description

    def _check(self, status: int, what: str) -> None:
        if status != 0:
            raise SchedulerError(f"{what}: {self._library.taper_scheduler_status_text(status).decode()}")


def station_names(library: Path = DEFAULT_LIBRARY) -> list[str]:
    """The stations that the library was built with."""
    loaded = _load(library)
    names: list[str] = []
    while (name := loaded.taper_scheduler_station_name(len(names))) is not None:
        names.append(name.decode())
    return names
