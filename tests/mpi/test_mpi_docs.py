"""The scripts of the README and of the tutorial run on several ranks, of which some have no particles."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("page", ["README.md", "docs/guide/tutorial.md"])
def test_the_script_of_a_page_runs_on_all_ranks(comm, shared_path, monkeypatch, page):
    monkeypatch.chdir(shared_path)
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), flags=re.DOTALL)
    scope: dict = {}
    exec(compile("\n".join(blocks), page, "exec"), scope)
    # The crest moves by some 0.14 m within 2 s, and by some centimetres within 0.6 s; all ranks print the same.
    moved = scope["moved"]
    assert len(set(comm.allgather(moved))) == 1 and 0.01 < moved < 0.3
    assert moved == max(comm.allgather(float(abs(scope["model"].particles.displacement).max(initial=0.0))))
