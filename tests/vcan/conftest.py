"""What the tests on a CAN interface share. All but those of the wrapper run inside tools/with-vcan."""

import contextlib
import os
import queue
import re
import subprocess
import threading
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PATIENCE_S = 30  # far more than anything takes here: a test that waits this long has failed


def program(variable):
    """The path of a built program, which the build gives in an environment variable."""
    path = os.environ.get(variable)
    if not path:
        pytest.fail(f"{variable} does not say where the program is; ctest sets it")
    return str(Path(path).resolve())


def wait_until(condition, what, timeout_s=PATIENCE_S):
    """Wait for `condition()` to be true, and give its value; the test fails, for lack of `what`, if it never is."""
    end = time.monotonic() + timeout_s
    while not (value := condition()):
        assert time.monotonic() < end, f"{what} did not happen within {timeout_s} s"
        time.sleep(0.02)
    return value


def system(*command):
    """Run a tool of the system's administrator, who alone has its folder in PATH."""
    environment = os.environ | {"PATH": os.environ["PATH"] + ":/usr/sbin:/sbin"}
    subprocess.run(command, check=True, timeout=PATIENCE_S, env=environment)


@contextlib.contextmanager
def medium(*discipline):
    """vcan0 as a medium that delays frames or takes few, by a queueing discipline of tc."""
    system("tc", "qdisc", "add", "dev", "vcan0", "root", *discipline)
    try:
        yield
    finally:
        system("tc", "qdisc", "del", "dev", "vcan0", "root")


class Running:
    """A program in the background. Its stdout is read as it comes, its stderr goes into stdout."""

    def __init__(self, arguments, **options):
        self.lines = []
        self._new = queue.SimpleQueue()
        self.process = subprocess.Popen([str(argument) for argument in arguments], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self.process.stdout:
            self.lines.append(line.rstrip("\n"))
            self._new.put(self.lines[-1])
        self._new.put(None)

    def wait_for(self, pattern, timeout_s=PATIENCE_S):
        """The next line in which `pattern` is found, as a match. Lines before it are passed over."""
        end = time.monotonic() + timeout_s
        while True:
            try:
                line = self._new.get(timeout=max(end - time.monotonic(), 0))
            except queue.Empty:
                line = None
            assert line is not None, f"no line with {pattern!r}; the program said:\n" + "\n".join(self.lines)
            if match := re.search(pattern, line):
                return match

    def say(self, line):
        """Write a line to the program's stdin."""
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def finish(self, timeout_s=PATIENCE_S):
        """Close stdin, wait for the end, and give the exit code."""
        self.process.stdin.close()
        code = self.process.wait(timeout_s)
        self._reader.join(timeout_s)
        return code

    def stop(self):
        """End it, if it still runs."""
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(5)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()


@pytest.fixture
def start():
    """start(ARGUMENT...) runs a program in the background until the end of the test."""
    running = []

    def run(*arguments, **options):
        running.append(Running(arguments, **options))
        return running[-1]

    yield run
    for one in reversed(running):
        one.stop()
