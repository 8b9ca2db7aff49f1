"""Reading numbers with errors that say where, and writing files that are either whole or not there."""

import math
import os
from pathlib import Path


class InputError(Exception):
    """Something that the user gave cannot be used. Its text is all that the user needs to mend it."""


def read_text(path: Path) -> str:
    """The text of a UTF-8 file, without a byte-order mark. Raises InputError."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: cannot be read: it is not UTF-8 text") from None


def number_at(text: str | None, where: str) -> float:
    """The finite number in a CSV field. `where` names file, line and column."""
    if text is None or text.strip() == "":
        raise InputError(f"{where}: is empty, a number is needed")
    try:
        value = float(text)
    except ValueError:
        raise InputError(f"{where}: '{text}' is not a number") from None
    if not math.isfinite(value):
        raise InputError(f"{where}: '{text}' is not a finite number")
    return value


def write_atomically(path: Path, text: str) -> None:
    """Writes beside the target, then renames: a reader sees the old file or the new one, never a part."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_text(text, encoding="utf-8", newline="")
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
