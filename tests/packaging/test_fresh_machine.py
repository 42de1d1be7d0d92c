"""What a stranger gets: a wheel in an empty environment, and `make demo` in a fresh checkout."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import venv
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
CLEAN = {
    key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "VIRTUAL"))
}


def _run(*command: str | Path, cwd: Path) -> str:
    done = subprocess.run(
        command, cwd=cwd, env=CLEAN, capture_output=True, encoding="utf-8", check=False, timeout=280
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    _run(sys.executable, "-m", "build", "--wheel", "--outdir", folder, ROOT, cwd=folder)
    (built,) = folder.glob("*.whl")
    return built


def test_the_wheel_judges_a_device_from_an_empty_folder(wheel: Path, tmp_path: Path) -> None:
    venv.create(tmp_path / "env", with_pip=True)
    binaries = tmp_path / "env" / ("Scripts" if os.name == "nt" else "bin")
    _run(binaries / "python", "-m", "pip", "install", "--quiet", wheel, cwd=tmp_path)
    empty = tmp_path / "empty"
    empty.mkdir()

    out = _run(binaries / "canopen-conformance", "run", "siko_ims360", cwd=empty)

    assert "CONFORMS" in out
    (record,) = empty.glob("reports/runs/*/results.json")
    assert json.loads(record.read_text("utf-8"))["summary"]["fail"] == 0


def test_make_demo_does_all_the_set_up(tmp_path: Path) -> None:
    if shutil.which("make") is None:
        pytest.skip("there is no make")
    checkout = tmp_path / "checkout"
    listed = _run("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", cwd=ROOT)
    for name in filter(None, listed.split("\0")):
        if (ROOT / name).is_file():
            (checkout / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, checkout / name)

    out = _run("make", "demo", cwd=checkout)

    assert "CONFORMS" in out
    folder = re.search(r"record: (\S+)", out)
    assert folder is not None
    assert (checkout / folder[1] / "junit.xml").is_file()


def test_the_readmes_python_example_works(tmp_path: Path) -> None:
    readme = (ROOT / "README.md").read_text("utf-8")
    (example,) = re.findall(r"```python\n(.*?)```", readme, re.DOTALL)

    assert "b'IMS360'" in _run(sys.executable, "-c", example, cwd=tmp_path)


def test_the_readmes_commands_work(tmp_path: Path) -> None:
    readme = (ROOT / "README.md").read_text("utf-8")
    commands = re.findall(r"^\$ canopen-conformance (.+)$", readme, re.MULTILINE)
    assert len(commands) >= 8
    command = Path(sys.executable).parent / "canopen-conformance"
    shutil.copytree(ROOT / "device_specs", tmp_path / "device_specs")
    for line in commands:
        arguments = [part.strip('"') for part in re.findall(r'"[^"]*"|\S+', line)]
        done = subprocess.run(
            [command, *arguments], cwd=tmp_path, capture_output=True, check=False, timeout=200
        )
        assert done.returncode == ("--fault" in arguments), line


def test_no_python_file_names_a_device() -> None:
    names = {"ims360", "gim140", "dst x730", "x730", "siko", "baumer", "danfoss"}
    for path in (ROOT / "conformance").rglob("*.py"):
        text = path.read_text("utf-8").lower()
        assert not [name for name in names if name in text], path
