"""Reads TOML tables strictly: every mistake becomes one line `FILE: KEY: reason` that a user can act on.

Tables of an array are counted from 1 in keys, in the order of the file: `connectors[2]` is the second
`[[connectors]]`.
"""

import math
import re
import tomllib
from pathlib import Path
from typing import Any


class TomlError(Exception):
    """A file that cannot be used. Its text is the line for the user."""

    def __init__(self, file: str, key: str, reason: str) -> None:
        super().__init__(f"{file}: {key}: {reason}")


_KINDS: dict[type, str] = {
    str: "a string",
    bool: "a boolean",
    int: "an integer",
    float: "a number",
    dict: "a table",
    list: "an array",
}


def _kind_of(value: object) -> str:
    return _KINDS.get(type(value), "a date or time")


def load(path: Path, shown: str) -> "Table":
    """The root table of the file at `path`, which messages call `shown`."""
    try:
        text = path.read_bytes().decode("utf-8")
    except OSError as error:
        raise TomlError(shown, "file", error.strerror or "cannot be read") from None
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise TomlError(shown, f"line {line}", "not UTF-8") from None
    try:
        return Table(tomllib.loads(text.replace("\r\n", "\n")), shown)
    except tomllib.TOMLDecodeError as error:
        raise _syntax_error(shown, str(error), text) from None


def _syntax_error(shown: str, message: str, text: str) -> TomlError:
    """Moves the line number, which Python 3.11 gives only inside the message, into the key's place."""
    found = re.fullmatch(r"(.*) \(at line (\d+), column (\d+)\)", message, re.DOTALL)
    reason, line = (found[1], int(found[2])) if found else (message, text.count("\n") + 1)
    reason = re.sub(r" \(at end of document\)$", ", at the end of the file", reason)
    return TomlError(shown, f"line {line}", " ".join(reason.split()))


class Table:
    """One table and its place in the file. `required`, `optional` and `end` say what it may hold."""

    def __init__(self, values: dict[str, Any], file: str, where: str = "") -> None:
        self._values = values
        self._file = file
        self._where = where
        self._known: set[str] = set()

    def error(self, key: str, reason: str) -> TomlError:
        """The error to raise for `key` of this table; an empty key is the table itself."""
        return TomlError(self._file, self._path(key), reason)

    def _path(self, key: str) -> str:
        shown = key if re.fullmatch(r"[A-Za-z0-9_-]*", key) else repr(key)
        return ".".join(part for part in (self._where, shown) if part)

    def _get(self, key: str, kind: type) -> Any:
        self._known.add(key)
        if key not in self._values:
            raise self.error(key, "missing")
        value = self._values[key]
        if kind is float and type(value) is int:
            value = self._as_float(key, value)
        if type(value) is not kind:  # not isinstance: a bool is an int there
            raise self.error(key, f"must be {_KINDS[kind]}, not {_kind_of(value)}")
        return value

    def _as_float(self, key: str, value: int) -> float:
        try:
            return float(value)
        except OverflowError:
            raise self.error(key, "is too large") from None

    def has(self, key: str) -> bool:
        self._known.add(key)
        return key in self._values

    def string(self, key: str, default: str | None = None) -> str:
        return default if default is not None and not self.has(key) else self._get(key, str)

    def boolean(self, key: str, default: bool) -> bool:
        return self._get(key, bool) if self.has(key) else default

    def strings(self, key: str) -> tuple[str, ...]:
        """An array of different strings, at least one."""
        values = self._get(key, list)
        if not values or any(type(value) is not str for value in values) or len(set(values)) != len(values):
            raise self.error(key, "must be an array of different strings, at least one")
        return tuple(values)

    def integer(self, key: str, least: int, most: int) -> int:
        value = self._get(key, int)
        if not least <= value <= most:
            raise self.error(key, f"must be {least} to {most}, not {value}")
        return value

    def quantity(self, key: str, least: int, most: int, per_unit: int, default: int | None = None) -> int:
        """A decimal number as an integer count of 1/per_unit, which it must be a multiple of.

        `least`, `most` and `default` are such counts: 0.1 A are quantity(key, ..., per_unit=10).
        """
        if default is not None and not self.has(key):
            return default
        value = self._get(key, float)
        if not math.isfinite(value):
            raise self.error(key, f"must be finite, not {value}")
        if value < least / per_unit or value > most / per_unit:
            raise self.error(key, f"must be {least / per_unit:g} to {most / per_unit:.10g}, not {value:.10g}")
        count = round(value * per_unit)
        if abs(count - value * per_unit) > 1e-6:
            raise self.error(key, f"must be a multiple of {1 / per_unit:g}, not {value:.10g}")
        return count

    def table(self, key: str) -> "Table":
        return Table(self._get(key, dict), self._file, self._path(key))

    def tables(self, key: str, most: int) -> list["Table"]:
        """The array of tables `[[key]]`: at least one, at most `most`."""
        values = self._get(key, list)
        if not values:
            raise self.error(key, "is empty")
        if len(values) > most:
            raise self.error(key, f"at most {most}, not {len(values)}")
        for number, value in enumerate(values, 1):
            if type(value) is not dict:
                raise self.error(f"{key}[{number}]", f"must be a table, not {_kind_of(value)}")
        return [Table(value, self._file, f"{self._path(key)}[{n}]") for n, value in enumerate(values, 1)]

    def named(self, key: str) -> dict[str, "Table"]:
        """The tables `[key.NAME]`, at least one, in the file's order. Messages call each by its name alone."""
        values = self._get(key, dict)
        if not values:
            raise self.error(key, "is empty")
        for name, value in values.items():
            if type(value) is not dict:
                raise self.error(name, f"must be a table, not {_kind_of(value)}")
        return {name: Table(value, self._file, self._path(name)) for name, value in values.items()}

    def end(self) -> None:
        """Refuses keys that nobody asked for: a misspelt optional key must not be dropped in silence."""
        for key in self._values:
            if key not in self._known:
                raise self.error(key, "unknown key")
