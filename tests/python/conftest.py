"""What tests of several files need."""

import importlib
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "studies"), str(ROOT)]  # studies, and what they have in common


def pytest_configure():
    # What starts the tests in the background, or by nohup, may have these signals ignored, which programs that the tests start
    # would inherit. A handler in Python is not inherited: studies then get the signals as they do in a terminal.
    for number in (signal.SIGINT, signal.SIGHUP):
        if signal.getsignal(number) == signal.SIG_IGN:
            signal.signal(number, lambda *_: None)


@pytest.fixture
def small_disk(tmp_path, request):
    """A file system of 600 kB, or of the size that a test asks for."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = shutil.which("mount")
    if (
        mount is None
        or subprocess.run(
            [mount, "-t", "tmpfs", "-o", f"size={getattr(request, 'param', '600k')}", "tmpfs", disk],
            capture_output=True,
        ).returncode
    ):
        pytest.skip("needs the right to mount a file system")
    yield disk
    subprocess.run(["umount", disk], check=True)


@pytest.fixture
def without_pictures(monkeypatch):
    """Studies in the process of the test draw neither figures nor films: for tests that read numbers only."""
    monkeypatch.setattr(importlib.import_module("common.summary"), "draw_pictures", lambda pictures: None)
