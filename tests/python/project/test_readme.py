"""The script in the README runs as it stands there."""

import re
from pathlib import Path


def test_the_script_of_the_readme_runs(capsys):
    text = (Path(__file__).parents[3] / "README.md").read_text()
    (script,) = re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)
    scope: dict = {}
    exec(compile(script, "README.md", "exec"), scope)
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 6 and lines[4].startswith("2.0 s")
    # The crest moves some 0.14 m within the first two seconds (0.11 m at 0.9 s, 0.28 m at 8.7 s in an independent code).
    assert 0.11 < abs(scope["model"].particles.displacement).max() < 0.28
