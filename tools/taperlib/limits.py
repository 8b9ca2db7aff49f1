"""The power limit of a site over time: a step function in kW, constant or from a CSV `time_s,limit_kw`."""

import csv
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .files import InputError, number_at, read_text


@dataclass(frozen=True)
class Limit:
    """Holds kw[i] from time_s[i] on; kw[0] also holds before time_s[0]. Both arrays have the same length >= 1."""

    time_s: np.ndarray
    kw: np.ndarray

    def at(self, time_s: np.ndarray) -> np.ndarray:
        index = np.searchsorted(self.time_s, time_s, side="right") - 1
        return self.kw[np.maximum(index, 0)]

    def mean_kw(self, edges_s: np.ndarray) -> np.ndarray:
        """The mean of the limit between each two neighbouring edges (ascending)."""
        inside = self.time_s[(self.time_s > edges_s[0]) & (self.time_s < edges_s[-1])]
        cuts_s = np.union1d(edges_s, inside)
        energy = np.concatenate([[0.0], np.cumsum(np.diff(cuts_s) * self.at(cuts_s[:-1]))])
        energy_at_edges = energy[np.searchsorted(cuts_s, edges_s)]
        return np.diff(energy_at_edges) / np.diff(edges_s)


def constant_limit(kw: float) -> Limit:
    if not kw >= 0:
        raise InputError(f"the limit of {kw:g} kW is less than 0")
    return Limit(np.array([0.0]), np.array([float(kw)]))


def read_limit_csv(path: Path) -> Limit:
    reader = csv.DictReader(io.StringIO(read_text(path)))
    missing = [name for name in ("time_s", "limit_kw") if name not in (reader.fieldnames or [])]
    if missing:
        raise InputError(f"{path}, line 1: the header lacks {', '.join(missing)}")
    times_s: list[float] = []
    limits_kw: list[float] = []
    for row in reader:
        where = f"{path}, line {reader.line_num}"
        time_s = number_at(row["time_s"], f"{where}, column time_s")
        limit_kw = number_at(row["limit_kw"], f"{where}, column limit_kw")
        if times_s and time_s <= times_s[-1]:
            raise InputError(f"{where}, column time_s: {time_s:g} is not after the line before ({times_s[-1]:g})")
        if limit_kw < 0:
            raise InputError(f"{where}, column limit_kw: {limit_kw:g} is less than 0")
        times_s.append(time_s)
        limits_kw.append(limit_kw)
    if not times_s:
        raise InputError(f"{path}: holds no limits")
    return Limit(np.array(times_s), np.array(limits_kw))
