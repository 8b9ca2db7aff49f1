"""Results on disk, a folder per case: build/study/cases/KEY. A folder that is there is finished."""

import csv
import gzip
import io
import json
import os
import shutil
import uuid
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .worker import DEPARTURES, MEASURES, STEPS, Files


@dataclass(frozen=True)
class Steps:
    """One entry per tick."""

    time_s: np.ndarray
    limit_kw: np.ndarray
    power_kw: np.ndarray


@dataclass(frozen=True)
class Result:
    folder: Path

    @property
    def measures(self) -> dict:
        return json.loads((self.folder / MEASURES).read_text(encoding="utf-8"))

    @property
    def energy_kwh(self) -> float:
        return self.measures["energy_kwh"]

    def steps(self) -> Steps:
        text = gzip.decompress((self.folder / STEPS).read_bytes()).decode()
        rows = [[float(row[name]) for name in ("time_s", "limit_kw", "power_kw")]
                for row in csv.DictReader(io.StringIO(text))]
        return Steps(*np.array(rows).T)

    def soc_at_departure(self) -> dict[str, float]:
        with (self.folder / DEPARTURES).open(newline="", encoding="utf-8") as file:
            return {row["session_id"]: float(row["soc_departure"]) for row in csv.DictReader(file)}


class Store:
    """Folders appear whole: each is written beside its place under another name, then renamed."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def has(self, key: str) -> bool:
        return (self.folder / key).is_dir()

    def result(self, key: str) -> Result:
        return Result(self.folder / key)

    def keep(self, key: str, files: Files) -> None:
        part = self.folder / f".{key}.{os.getpid()}.{uuid.uuid4().hex[:8]}.part"
        part.mkdir()
        try:
            for name, content in files.items():
                (part / name).write_bytes(content)
            part.rename(self.folder / key)
        except OSError:
            if not self.has(key):  # else another study has just finished the same case
                raise
        finally:
            shutil.rmtree(part, ignore_errors=True)
