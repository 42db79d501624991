"""Scenes that are Python: what they do to their process reaches no other scene and no result."""

import json
import os
import sys
from pathlib import Path

import pytest

from fotismos.heuristic.errors import InputError
from fotismos.reference.scene.source import Script
from tests.shared.small_scene import SCENE

SCENE_OF = """
import mitsuba as mi

def scene():
    {}
    return mi.load_string and {{
        "type": "scene",
        "sensor": {{"type": "perspective",
                   "to_world": mi.ScalarTransform4f().look_at((0, -4, 0), (0, 0, 0), (0, 0, 1))}},
        "ball": {{"type": "sphere"}},
        "light": {{"type": "constant"}},
    }}
"""

DEEDS = {
    "breaks modules": "import json, fotismos.comparisons.compare as c;"
    " json.dumps = c.compare = None",
    "changes its process": "import os, sys; os.chdir('/'); os.umask(0o777); os.environ.clear();"
    " os.write(1, b'words'); print('more'); sys.path.clear(); sys.argv.clear();"
    " mi.set_variant('scalar_rgb') if 'scalar_rgb' in mi.variants() else None",
    "forks twice": "import os; os.fork() or os.fork()",
    "does not end": "import signal, subprocess, threading, time;"
    " signal.signal(signal.SIGTERM, signal.SIG_IGN); subprocess.Popen(['sleep', '1000']);"
    " threading.Thread(target=time.sleep, args=(1000,)).start()",
}


@pytest.mark.thorough
@pytest.mark.guarantee("runs", "A scene's script affects no other scene.")
def test_what_scripts_do_reaches_no_other_scene(run, apart, tmp_path):
    folder, out = tmp_path / "scenes", tmp_path / "out"
    folder.mkdir()
    for number, deed in enumerate(DEEDS.values()):
        (folder / f"{number:02}.py").write_text(SCENE_OF.format(deed))
        (folder / f"{number:02}-next.xml").write_text(SCENE)
    size = ("--spp", 4, "--resolution", "8x8", "-q")
    words = ("compare", *sorted(folder.iterdir()), "-o", out, *size)
    here, mask, environment = Path.cwd(), os.umask(0o022), dict(os.environ)
    code, _, messages = run(*words)
    assert (Path.cwd(), os.umask(mask), dict(os.environ)) == (here, 0o022, environment)
    run_record = json.loads((out / "run.json").read_text())
    failed = {failure["scene"] for failure in run_record["failures"]}
    # Only a scene that breaks what compares it may fail, and it alone.
    broken = f"{list(DEEDS).index('breaks modules'):02}"
    assert failed <= {broken}, messages
    assert code == (1 if failed else 0)
    for number in range(len(DEEDS)):
        place = out / f"{number:02}-next"
        record = json.loads((place / "comparison.json").read_text())
        assert record["scene"] == place.name
        assert (place / "comparison.json").stat().st_mode & 0o777 == 0o644


def test_a_script_finds_its_process_as_it_left_it(tmp_path, rgb):
    path = tmp_path / "scene.py"
    path.write_text(SCENE_OF.format("import os; os.chdir('/'); os.environ['A_B_C'] = '1'"))
    before = Path.cwd(), list(sys.path), list(sys.argv)
    Script(path)()
    assert (Path.cwd(), sys.path, sys.argv) == before
    assert "A_B_C" not in os.environ
    path.write_text(SCENE_OF.format("import os; os.chdir('/'); 1 / 0"))
    with pytest.raises(InputError, match="ZeroDivisionError"):
        Script(path)()
    assert Path.cwd() == before[0]
