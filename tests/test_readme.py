"""The README's example runs as it is printed, in a process of its own."""

import re

from tests.programs import ROOT, python


def test_the_readmes_example_runs(tmp_path):
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text("utf-8"), re.DOTALL)
    done = python("-c", code + "print(colour)", cwd=tmp_path, PYTHONWARNINGS="error")
    assert (done.returncode, done.stderr) == (0, "")
    # k_a + k_d (N.L) with N.L = 4 / 5; the mirror direction is as far off the viewer, to the ninth.
    expected = [0.3 + k_d * 0.8 + 0.7 * 0.8**9 for k_d in (0.5, 0.4, 0.3)]
    found = [float(number) for number in re.findall(r"[\d.]+", done.stdout)]
    assert all(abs(a - b) < 1e-5 for a, b in zip(found, expected, strict=True))
