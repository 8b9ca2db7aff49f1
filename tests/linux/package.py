"""Debian packages, and a scratch root that dpkg keeps. No root rights are needed."""

import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ARCHITECTURES = {"x86_64": "amd64", "aarch64": "arm64", "armv7l": "armhf"}
ELF_MACHINES = {"amd64": (2, 62), "arm64": (2, 183), "armhf": (1, 40)}  # class and machine
LONGEST_S = 300


def run(*command: object, **more: object) -> str:
    """What a command prints. It has to succeed."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False,
                          timeout=LONGEST_S, **more)
    assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
    return done.stdout


def architecture() -> str:
    return ARCHITECTURES[os.environ["TAPER_PROCESSOR"]]


def emulator() -> list[str]:
    return os.environ["TAPER_EMULATOR"].split()


def machine(program: Path) -> tuple[int, int]:
    """Class and machine in the head of an ELF file of little-endian numbers."""
    head = program.read_bytes()[:20]
    assert head[:4] == b"\x7fELF"
    return head[4], int.from_bytes(head[18:20], "little")


@dataclass(frozen=True)
class Package:
    path: Path

    def field(self, name: str) -> str:
        return run("dpkg-deb", "--field", self.path, name).strip()

    def listing(self) -> dict[str, tuple[str, str]]:
        """Path: mode and owner, of files and folders."""
        rows = [line.split() for line in run("dpkg-deb", "--contents", self.path).splitlines()]
        return {row[5].removeprefix("."): (row[0], row[1]) for row in rows}

    def files(self) -> set[str]:
        return {name for name in self.listing() if not name.endswith("/")}

    def control(self, name: str) -> str:
        return run("dpkg-deb", "--info", self.path, name)


class Machine:
    """A root folder with nothing in it but dpkg's records."""

    def __init__(self, root: Path) -> None:
        self.root = root
        for folder in ("info", "updates"):
            (root / "var/lib/dpkg" / folder).mkdir(parents=True)
        for file in ("status", "available"):
            (root / "var/lib/dpkg" / file).touch()

    def dpkg(self, *arguments: object) -> str:
        paths = {"PATH": os.environ["PATH"] + ":/usr/sbin:/sbin"}
        return run("dpkg", f"--root={self.root}", "--force-not-root", "--force-script-chrootless", "--force-architecture",
                   "--force-depends", "--force-confold", "--log=/dev/null", *arguments,
                   env=os.environ | paths, stdin=subprocess.DEVNULL)

    def at(self, path: str) -> Path:
        return self.root / path.lstrip("/")
