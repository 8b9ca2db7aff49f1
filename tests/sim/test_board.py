"""A station on a board (--bus): the same bytes as within the program, and errors that say what is wrong with the board."""

import os
import socket
import subprocess
import threading
from contextlib import contextmanager, suppress

import pytest
from conftest import csv_text, session

# Who comes and goes, waits for others, and leaves early, at a limit that drops.
CARS = [session(f"car-{k}", arrival_s=200 * k, departure_s=5400 + 600 * k, max_kw=7 + 2 * k, soc_arrival=0.1 + 0.04 * k,
                soc_target=0.8, battery_kwh=40 + 3 * k, phases=1 if k == 4 else "") for k in range(10)]
LIMITS = "time_s,limit_kw\n0,40\n3000,15\n6000,30\n"
PRICES = "time_s,price_per_kwh\n0,0.3\n3600,0.1\n7200,0.4\n"
HELLO = b"T1FFF84004%s\r"
FILES = ("sessions.csv", "steps.csv", "connectors.csv")


@contextmanager
def twin(*words, station="hub"):
    """A board on the host. Gives what to say to --bus."""
    program = os.environ.get("TAPER_BOARD_TWIN")
    if not program:
        pytest.fail("TAPER_BOARD_TWIN does not say where board_twin is")
    with subprocess.Popen([program, station, *words], stdout=subprocess.PIPE, text=True) as board:
        try:
            yield f"slcan:127.0.0.1:{board.stdout.readline().strip()}"
        finally:
            board.kill()


@contextmanager
def board_that(answer):
    """A peer that takes one connection, and gives it to `answer`."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve():
            connection, _ = server.accept()
            with connection, suppress(ConnectionError):
                answer(connection)

        thread = threading.Thread(target=serve)
        thread.start()
        yield f"slcan:127.0.0.1:{server.getsockname()[1]}"
        thread.join()


def run(sim, *arguments, policy="soc-mpc", out="out"):
    sim.write("limits.csv", LIMITS)
    sim.write("prices.csv", PRICES)
    return sim.run(CARS, "--limit-csv", "limits.csv", "--price-csv", "prices.csv", "--frames", f"{out}.log", *arguments,
                   policy=policy, out=out)


def assert_equal(here, there):
    """All bytes of both runs, but for what only one of them can measure."""
    assert (here.code, there.code) == (0, 0), there.stderr
    for name in FILES:
        assert (here.out / name).read_bytes() == (there.out / name).read_bytes(), name
    logs = [(one.out.parent / f"{one.out.name}.log").read_bytes() for one in (here, there)]
    assert logs[0] == logs[1]
    assert logs[0].count(b"\n") > 1000
    assert without_measures(here.summary) == without_measures(there.summary)


def without_measures(summary):
    return {name: value for name, value in summary.items() if name not in ("solve_ms", "board")}


def test_a_board_gives_the_same_bytes(planning_sim):
    here = run(planning_sim, "--min-current-a", "6", "--price-weight", "0.5", out="here")
    with twin() as bus:
        there = run(planning_sim, "--min-current-a", "6", "--price-weight", "0.5", "--bus", bus, out="there")
    assert_equal(here, there)
    assert here.summary["solves"] > 10


@pytest.mark.parametrize("policy", ["edf", "edf-soc", "llf"])
def test_a_board_has_the_policies_of_the_firmware(sim, policy):
    here = run(sim, policy=policy, out="here")
    with twin() as bus:
        there = run(sim, "--bus", bus, policy=policy, out="there")
    assert_equal(here, there)


def test_ticks_in_slices_give_the_same_bytes(planning_sim):
    planning_sim.write("short.csv", csv_text([session("a", departure_s=600, max_kw=20), session("b", departure_s=400)]))
    common = ["--sessions", "short.csv", "--policy", "soc-mpc", "--station", "hub", "--tick-s", "1",
              "--iterations", "10"]
    here = planning_sim.call(*common, "--out", "here", "--frames", "here.log", out="here")
    with twin() as bus:
        there = planning_sim.call(*common, "--out", "there", "--frames", "there.log", "--bus", bus, out="there")
    assert_equal(here, there)
    work = there.summary["board"]["instructions_per_tick"]
    assert (work["p50"], work["max"], work["max_without_slice"]) == (1000, 1010, 1000)


def test_lines_may_be_cut_anywhere(sim):
    here = run(sim, policy="llf", out="here")
    with twin("pieces") as bus:
        there = run(sim, "--bus", bus, policy="llf", out="there")
    assert_equal(here, there)


def test_a_board_runs_once_more(sim):
    with twin() as bus:
        runs = [run(sim, "--bus", bus, policy="edf", out=out) for out in ("one", "two")]
    assert_equal(*runs)


def test_what_was_measured_is_told(sim):
    with twin() as bus:
        there = run(sim, "--bus", bus, policy="edf")
    assert there.summary["solve_ms"] is None
    frames = {key: there.summary["board"][key]
              for key in ("mean_instructions_per_frame", "max_instructions_for_frames_of_tick")}
    assert 0 < frames["mean_instructions_per_frame"] <= 1000 <= frames["max_instructions_for_frames_of_tick"]
    assert there.summary["board"] == {
        "instructions_per_tick": {"p50": 1000, "max": 1000, "max_without_slice": 1000},
        "max_instructions_per_poll": 1000, **frames, "stack_used_b": 1234, "stack_size_b": 8192}
    assert "instructions per tick p50 1000" in there.stdout
    assert "stack 1234 of 8192 bytes" in there.stdout


def test_a_run_within_the_program_tells_of_no_board(sim):
    assert "board" not in run(sim, policy="edf").summary


def test_frames_are_in_the_order_of_time_and_need_no_directory(sim):
    sim.write("cars.csv", csv_text(CARS))
    done = sim.call("--sessions", "cars.csv", "--policy", "edf", "--station", "hub", "--frames", "frames.log")
    assert done.code == 0, done.stderr
    lines = (sim.folder / "frames.log").read_text().splitlines()
    times = [float(line[1:line.index(")")]) for line in lines]
    assert times == sorted(times)
    assert times[0] == 0.0
    assert all(line.split()[1] == "can0" for line in lines)


def test_frames_that_cannot_be_written_are_an_error(sim):
    done = run(sim, "--frames", "missing/frames.log", policy="edf")
    assert done.code == 1
    assert "missing/frames.log" in done.stderr
    assert not done.out.exists()


@pytest.mark.parametrize("fault, reason", [
    ("reset", "it was reset, where the "),
    ("silent", "it has said nothing for 1 s, where the end of the "),
    ("close", "the connection is lost, where the end of the "),
    ("crash", "the connection is lost, where the end of the "),
    ("strange", "it says 'HardFault pc=1234', where the end of the "),
    ("refuse", "it refused a line as none of SLCAN, where the end of the "),
])
def test_a_board_that_fails_in_the_middle_ends_the_run(sim, fault, reason):
    with twin(f"{fault}@60") as bus:
        done = run(sim, "--bus", bus, "--bus-timeout-s", "1", policy="edf")
    assert done.code == 1
    assert done.stderr.startswith(f"taper-sim: board at {bus[6:]}: {reason}")
    assert done.stderr.count("\n") == 1
    assert not done.out.exists()


def test_a_board_that_was_reset_takes_the_next_run(sim):
    here = run(sim, policy="edf", out="here")
    with twin("reset@60") as bus:
        assert run(sim, "--bus", bus, policy="edf", out="failed").code == 1
        assert_equal(here, run(sim, "--bus", bus, policy="edf", out="there"))


def test_another_station_is_refused(sim):
    with twin(station="garage") as bus:
        done = run(sim, "--bus", bus, policy="edf")
    assert (done.code, done.stderr) == (
        1, f"taper-sim: board at {bus[6:]}: it is station garage with 54 connectors, and not hub\n")


def test_an_image_without_a_planner_cannot_plan(sim):
    with twin("no-planner") as bus:
        done = run(sim, "--bus", bus)
        assert run(sim, "--bus", bus, policy="llf").code == 0
    assert (done.code, done.stderr) == (
        1, f"taper-sim: board at {bus[6:]}: its image has no planner, which policy soc-mpc needs\n")


@pytest.mark.parametrize("version", [b"02000000", b"00000000"])
def test_another_version_is_refused(sim, version):
    def answer(connection):
        connection.sendall(b"rest of a line\r\r\a\r" + HELLO % version)
        while connection.recv(1000):
            pass

    with board_that(answer) as bus:
        done = run(sim, "--bus", bus, policy="edf")
    assert done.code == 1
    assert f"it obeys version {version[1:2].decode()} of the drive protocol, and not 1" in done.stderr


@pytest.mark.parametrize("said", [b"", b"\r\r\r", b"z\rt0C18\r\a", b"T1FFF83"])
def test_a_peer_that_does_not_greet_is_no_board(sim, said):
    def answer(connection):
        connection.sendall(said)
        while connection.recv(1000):
            pass

    with board_that(answer) as bus:
        done = run(sim, "--bus", bus, "--bus-timeout-s", "1", policy="edf")
    assert done.code == 1
    assert "it has said nothing for 1 s, where its greeting was awaited" in done.stderr


def test_a_peer_that_hangs_up_is_no_board(sim):
    with board_that(lambda connection: None) as bus:
        done = run(sim, "--bus", bus, policy="edf")
    assert done.code == 1
    assert "the connection is lost, where its greeting was awaited" in done.stderr


def test_answers_out_of_turn_are_refused(sim):
    def answer(connection):
        connection.sendall(HELLO % b"01000000" + b"T1FFF81040000\rT1FFF8103800000000\rT1FFF83058000000000\r")
        while connection.recv(1000):
            pass

    with board_that(answer) as bus:
        done = run(sim, "--bus", bus, policy="edf")
    assert done.code == 1
    assert "where the number of its connectors was awaited" in done.stderr


def test_a_peer_that_sends_without_end_is_given_up(sim):
    def answer(connection):
        connection.sendall(HELLO % b"01000000" + b"t0010\r" * 5000)
        while connection.recv(1000):
            pass

    with board_that(answer) as bus:
        done = run(sim, "--bus", bus, policy="edf")
    assert done.code == 1
    assert "it sends more than 4096 frames, where the number of its connectors was awaited" in done.stderr


def test_nobody_there_is_told(sim):
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"127.0.0.1:{server.getsockname()[1]}"
    done = run(sim, "--bus", f"slcan:{address}", "--bus-timeout-s", "1", policy="edf")
    assert (done.code, done.stderr) == (1, f"taper-sim: --bus: {address}: Connection refused\n")


@pytest.mark.parametrize("arguments, reason", [
    (["--bus", "can0"], "--bus: must be slcan:HOST:PORT: 'can0'"),
    (["--bus", "slcan:localhost"], "--bus: must be slcan:HOST:PORT: 'slcan:localhost'"),
    (["--bus", "slcan::1"], "--bus: must be slcan:HOST:PORT: 'slcan::1'"),
    (["--bus", "slcan:localhost:1", "--policy", "equal-share"], "--policy equal-share: a board (--bus) does not have it"),
    (["--bus", "slcan:localhost:1", "--problems", "x"], "--problems and --bus exclude each other"),
    (["--bus", "slcan:localhost:1", "--station", "paper"], "--bus: station paper has 3 CAN buses"),
    (["--bus-timeout-s", "5"], "--bus-timeout-s needs --bus"),
    (["--bus", "slcan:localhost:1", "--bus-timeout-s", "0"], "--bus-timeout-s"),
])
def test_what_a_board_cannot_do_is_told_before_the_run(sim, arguments, reason):
    done = run(sim, *arguments, policy="edf")
    assert done.code == 2
    assert reason in done.stderr
