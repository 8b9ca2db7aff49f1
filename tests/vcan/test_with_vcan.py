"""tools/with-vcan gives a command CAN interfaces, and is otherwise not to be noticed."""

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import PATIENCE_S, ROOT, wait_until

WRAPPER = ROOT / "tools" / "with-vcan"
MADE_BY_SHELLS = {"_", "OLDPWD", "PWD", "SHLVL"}
ODD_ARGUMENTS = ["two words", "", "it's", 'say "hi"', "$HOME *", "new\nline", "-r", "back\\slash", "é"]

# Says on stdout, as JSON, what it finds around it, and a word on stderr.
LOOK_AROUND = """
import json, os, socket, sys
socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW).bind(("vcan1",))
print(json.dumps({
    "arguments": sys.argv[1:], "folder": os.getcwd(), "environment": dict(os.environ), "stdin": sys.stdin.read(),
    "up": {name: int(open(f"/sys/class/net/{name}/flags").read(), 16) & 1 for name in ("vcan0", "vcan1")},
    "user": os.geteuid()}))
sys.exit("a word on stderr")
"""

WRITE_A_MEGABYTE = """
import os, sys
data = bytes(range(256)) * 4096
for stream, bytes_ in ((sys.stdout, data), (sys.stderr, data[::-1])):
    stream.buffer.write(bytes_)
    stream.flush()
os.kill(os.getpid(), 9)
"""


def start_wrapped(*command, options=(), **settings):
    return subprocess.Popen([WRAPPER, *options, *command], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, **settings)


def run_wrapped(*command, **settings):
    """Exit status as a shell sees it, stdout, stderr."""
    process = start_wrapped(*command, **settings)
    out, err = process.communicate(timeout=4 * PATIENCE_S)
    return status(process), out, err


def status(process):
    return process.returncode if process.returncode >= 0 else 128 - process.returncode


def processes_that_mention(text):
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if str(text).encode() in (folder / "cmdline").read_bytes():
                found.append(folder.name)
        except OSError:
            pass  # it has ended
    return found


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    """What a command in an odd folder with an odd environment finds around it, with two interfaces."""
    folder = tmp_path_factory.mktemp("odd 'folder'")
    environment = os.environ | {"ODD": "two\nlines and 'quotes' \\ ", "EMPTY": ""}
    code, out, err = run_wrapped(sys.executable, "-c", LOOK_AROUND, *ODD_ARGUMENTS, options=["-i", "vcan0 vcan1"],
                                 cwd=folder, env=environment)
    assert out, err.decode()
    return json.loads(out) | {"code": code, "stderr": err.decode(), "expected": (str(folder), environment)}


def test_all_named_interfaces_are_up(seen):
    assert seen["up"] == {"vcan0": 1, "vcan1": 1}


def test_arguments_arrive_unchanged(seen):
    assert seen["arguments"] == ODD_ARGUMENTS


def test_the_command_runs_in_the_callers_folder_as_the_caller(seen):
    assert (seen["folder"], seen["user"]) == (seen["expected"][0], os.geteuid())


def test_the_environment_is_the_callers(seen):
    def comparable(environment):
        return {name: value for name, value in environment.items() if name not in MADE_BY_SHELLS}

    assert comparable(seen["environment"]) == comparable(seen["expected"][1])


def test_stdin_is_empty(seen):
    assert seen["stdin"] == ""


def test_the_exit_code_and_stderr_pass_through_on_their_own(seen):
    assert (seen["code"], seen["stderr"]) == (1, "a word on stderr\n")


def test_a_megabyte_on_each_output_arrives_whole_even_after_a_killing_signal():
    expected = bytes(range(256)) * 4096
    code, out, err = run_wrapped(sys.executable, "-c", WRITE_A_MEGABYTE)
    assert (code, len(out), len(err)) == (128 + 9, len(expected), len(expected))
    assert (out, err) == (expected, expected[::-1])


def test_runs_at_the_same_time_do_not_meet():
    both = [start_wrapped("bash", "-c", f"candump -n 2 -T {1000 * PATIENCE_S} vcan0 & sleep 0.5; cansend vcan0 00{n}#;"
                          f"cansend vcan0 00{n}#; wait", options=["-r"]) for n in (1, 2)]
    heard = [process.communicate(timeout=4 * PATIENCE_S)[0].decode().split() for process in both]
    assert [one[1::3] for one in heard] == [["001", "001"], ["002", "002"]]


def test_with_r_the_command_can_make_the_medium_lose_all_frames():
    script = "PATH=$PATH:/usr/sbin:/sbin; tc qdisc add dev vcan0 root netem loss 100% || exit;" \
             "candump -T 1000 vcan0 & sleep 0.5; cansend vcan0 001#; wait; echo end"
    code, out, err = run_wrapped("bash", "-c", script, options=["-r"])
    assert (code, out, err) == (0, b"end\n", b"")


@pytest.mark.parametrize("end", [signal.SIGTERM, signal.SIGKILL], ids=["terminated", "killed"])
def test_nothing_stays_behind_a_wrapper_that_is(end, tmp_path):
    process = start_wrapped("bash", "-c", "echo started; exec sleep 1000", env=os.environ | {"TMPDIR": str(tmp_path)})
    assert process.stdout.readline() == b"started\n"
    process.send_signal(end)
    process.communicate(timeout=PATIENCE_S)
    assert status(process) == 128 + end
    wait_until(lambda: not os.listdir(tmp_path), "the end of the temporary files")
    wait_until(lambda: not processes_that_mention(tmp_path), "the end of the guest")


def test_without_the_packages_it_says_what_to_install(tmp_path):
    (tmp_path / "bash").symlink_to(shutil.which("bash"))
    code, out, err = run_wrapped("true", env={"PATH": str(tmp_path), "WITH_VCAN": "uml"})
    assert (code, out) == (125, b"")
    assert b"sudo apt-get install user-mode-linux kmod iproute2" in err


def test_a_wrong_call_says_how_to_call():
    code, out, err = run_wrapped(options=["-x"])
    assert (code, out) == (125, b"")
    assert b"usage: tools/with-vcan" in err
