"""The study locking: mixed discretisation frees what plain linear triangles lock."""

import json
import subprocess
import sys
from pathlib import Path

STUDY = Path(__file__).parents[2] / "studies" / "locking.py"


def test_cooks_membrane_locks_without_mixed_discretisation(tmp_path):
    result = subprocess.run([sys.executable, str(STUDY), "--output", str(tmp_path), "--meshes", "2",
                             "--reference-divisions", "32"], capture_output=True, text=True, timeout=300)  # fmt: skip
    assert result.returncode == 0, result.stderr
    assert (tmp_path / "error.png").stat().st_size > 0 and (tmp_path / "pressure.png").stat().st_size > 0
    rows = json.loads((tmp_path / "summary.json").read_text())["cook"]
    stiff = {(row["elements"], row["divisions"]): row for row in rows if row["poisson"] > 0.4999999}
    # The benchmark's number at the middle of the loaded edge is 16.44.
    assert abs(stiff["NMD", 16]["reference_m"] / 16.44 - 1) < 5e-3
    assert stiff["plain", 16]["error"] > 1 / 3
    assert stiff["NMD", 16]["error"] < 0.6 * stiff["NMD", 8]["error"]
