"""What tests of several files need."""

import shutil
import subprocess

import pytest


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
