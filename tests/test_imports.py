"""What a comparison imports: the rooms that it passes through, and no others."""

from tests.programs import python

OURS = ("heuristic", "reference", "comparisons", "reports")
"""The packages of the project."""

ELSEWHERE = ("hard", "fit", "study", "check")
"""Folders of comparisons that comparing two images has no need of."""

COMPARE = """
import sys
from reports import cli, jobs
jobs.IN_PROCESSES = False
words = "compare fig-8-9 --no-why --resolution 16x16 -q -o".split()
sys.argv = ["fotismos", *words, sys.argv[1]]
cli.main()
print(*sorted(sys.modules))
"""


def test_a_comparison_of_a_built_in_scene_imports_what_it_needs(tmp_path):
    done = python("-c", COMPARE, tmp_path / "out")
    assert done.returncode == 0, done.stderr
    modules = [name for name in done.stdout.split() if name.partition(".")[0] in OURS]
    assert "comparisons.compare" in modules
    for folder in ELSEWHERE:
        assert [name for name in modules if name.startswith(f"comparisons.{folder}")] == []
