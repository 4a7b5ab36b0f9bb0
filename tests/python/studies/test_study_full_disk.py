"""A disk that fills up: what was computed is stored, the reason is the last line, and pictures cost only themselves."""

import contextlib
import json
import os
import subprocess
import sys
import threading
import time

import pytest
from test_study_restart import ENVIRONMENT, SMALL, STUDIES

FRAMES = ["--frames", "30"]


def slope(folder, *options, during=None):
    command = [sys.executable, str(STUDIES / "slope.py"), "--output", str(folder), *SMALL, *FRAMES, *options]
    if during is not None:
        threading.Thread(target=during, daemon=True).start()
    return subprocess.run(command, capture_output=True, text=True, timeout=100, env=ENVIRONMENT)


def fill(disk, left=0):
    """Leave so many bytes on the disk."""
    room = os.statvfs(disk)
    with contextlib.suppress(OSError):  # the run takes room meanwhile
        (disk / "other").write_bytes(bytes(max(0, room.f_bavail * room.f_bsize - left)))


@pytest.mark.parametrize("small_disk", ["2m"], indirect=True)
def test_a_disk_that_is_full_during_the_slide(small_disk):
    folder = small_disk / "slope"

    def fill_when_it_slides():
        while not (folder / "history.csv").exists() or (folder / "history.csv").read_text().count("\n") < 3:
            time.sleep(0.005)
        fill(small_disk, left=60_000)

    result = slope(folder, during=fill_when_it_slides)
    assert result.returncode == 1 and "Traceback" not in result.stderr, result.stderr
    assert "No space left on device" in result.stderr.strip().splitlines()[-1]
    summary = json.loads((folder / "summary.json").read_text())
    assert not summary["finished_run"] and "No space left on device" in summary["stopped_because"]


@pytest.mark.parametrize("small_disk", ["1300k"], indirect=True)
def test_a_disk_too_small_for_the_pictures_alone(small_disk):
    result = slope(small_disk / "slope", "--frames", "2", "--pictures")
    assert result.returncode == 1 and "Traceback" not in result.stderr, result.stderr
    assert "cannot write" in result.stderr.strip().splitlines()[-1]
    summary = json.loads((small_disk / "slope" / "summary.json").read_text())
    assert summary["finished_run"] and summary["crest_displacement_m"] > 0
    assert not list((small_disk / "slope").glob("*.part"))
