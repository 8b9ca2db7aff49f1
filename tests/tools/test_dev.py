"""tools/dev's own verdict: its exit status is what CI goes by. Its steps are stood in for; it looks for no packages."""

import os
import shutil
import subprocess

import pytest
from conftest import ROOT

CTEST = """#!/bin/bash
case " $* " in
    *"$BREAK"*) echo "0% tests passed, 1 tests failed out of 1"; exit 8 ;;
    *) echo "100% tests passed, 0 tests failed out of 1" ;;
esac
"""


@pytest.fixture
def tree(tmp_path):
    """A tree in which every build is done at once, and a test fails only if BREAK is in its command line."""
    def program(path, text="#!/bin/bash\n"):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        path.chmod(0o755)

    begin = "missing_packages() {\n"
    script = (ROOT / "tools" / "dev").read_text()
    assert begin in script
    program(tmp_path / "tools" / "dev", script.replace(begin, begin + "    return\n"))
    for requirements in (ROOT / "tools").glob("requirements*.txt"):
        shutil.copy(requirements, tmp_path / "tools")
    program(tmp_path / "tools" / "fetch_sources")
    program(tmp_path / "bin" / "cmake", '#!/bin/bash\necho "cmake version 3.25.1"\n')
    program(tmp_path / "bin" / "ctest", CTEST)
    program(tmp_path / "bin" / "python3", """#!/bin/bash
[[ $1 != -m ]] || { mkdir -p "$3/bin"; printf '#!/bin/bash\\n' >"$3/bin/python"; chmod +x "$3/bin/python"; }
""")
    return tmp_path


def run_tests(tree, breaks):
    path = f"{tree / 'bin'}:{os.environ['PATH']}"
    return subprocess.run(["bash", tree / "tools" / "dev", "test"], env={**os.environ, "PATH": path, "BREAK": breaks},
                          capture_output=True, text=True, timeout=60)


def test_all_presets_passing_is_success(tree):
    done = run_tests(tree, "no command line has this")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "FAILED" not in done.stdout
    assert done.stdout.count(": passed in") == 9


@pytest.mark.parametrize("breaks, named", [
    (" -L clock ", "host-release, by the clock"),
    (" -LE clock ", "host-release, the others"),
    (" host-debug ", "host-debug"),
    (" linux-aarch64 ", "linux-aarch64"),
])
def test_one_preset_failing_is_failure(tree, breaks, named):
    done = run_tests(tree, breaks)
    assert done.returncode == 1
    assert [line.split(":")[0] for line in done.stdout.splitlines() if ": FAILED in" in line] == [named]
