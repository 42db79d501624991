"""The scripts' JSDoc types: of the data that the page holds, and the compiler that checks them."""

import json
import re
import subprocess
from pathlib import Path
from urllib.request import url2pathname

import pytest

ROOT = Path(__file__).parents[2]
COMPILER = ROOT / "tests/javascript/node_modules/.bin/tsc"
SCRIPTS = ROOT / "reports/page/templates/viewer"
LOCKS = ["tests/javascript"]

compiler = pytest.mark.skipif(not COMPILER.exists(), reason="npm ci --prefix tests/javascript")

JSON = re.compile(r'<script type="application/json"[^>]*>(.*?)</script>', re.DOTALL)


@pytest.fixture(scope="session")
def written(report):
    """The data of the page's scripts, by the name of its type."""
    html = Path(url2pathname(report.url.removeprefix("file://"))).read_text()
    (data,) = map(json.loads, JSON.findall(html))
    return {"Page": data}


def checked(written, folder):
    """Return what the compiler says of the scripts and of data, assigned to its types."""
    lines = [
        f"/** @type {{{kind}}} */ const own{kind} = {json.dumps(written[kind])};"
        for kind in written
    ]
    (folder / "written.js").write_text("\n".join(lines))
    project = {
        "extends": str(ROOT / "tests/javascript/tsconfig.json"),
        "include": [str(SCRIPTS / "*.js"), "written.js"],
    }
    (folder / "tsconfig.json").write_text(json.dumps(project))
    words = [str(COMPILER), "--project", str(folder)]
    return subprocess.run(words, capture_output=True, text=True, timeout=120).stdout


@compiler
def test_the_types_of_data_are_those_of_what_python_writes(written, tmp_path):
    scenes = written["Page"]["scenes"]
    assert {bool(scene.get("terms") and scene["terms"]["grid"]) for scene in scenes} == {
        True,
        False,
    }
    assert {bool(scene.get("live") and scene["live"]["grid"]) for scene in scenes} == {True, False}
    assert any(scene.get("board") for scene in scenes)
    assert any(scene.get("regions") for scene in scenes)
    assert any(scene.get("failed") for scene in scenes)
    assert checked(written, tmp_path) == ""


@compiler
def test_data_of_other_types_are_found(written, tmp_path):
    other = json.loads(json.dumps(written))
    other["Page"]["epsilon"] = "1"
    del other["Page"]["scenes"][0]["board"]["hybrids"][0]["mean"]
    said = checked(other, tmp_path)
    assert "Type 'string' is not assignable to type 'number'" in said
    assert "Property 'mean' is missing" in said


@pytest.mark.parametrize("folder", LOCKS)
def test_npm_packages_have_one_version_and_a_hash_and_no_address(folder):
    wanted = json.loads((ROOT / folder / "package.json").read_text())["dependencies"]
    text = (ROOT / folder / "package-lock.json").read_text()
    packages = {name: each for name, each in json.loads(text)["packages"].items() if name}
    for name, version in wanted.items():
        assert packages[f"node_modules/{name}"]["version"] == version
    assert all(each["integrity"].startswith("sha512-") for each in packages.values())
    assert "://" not in text
