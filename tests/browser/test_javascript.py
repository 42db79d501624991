"""The scripts' JSDoc types: of the data that the page holds, and the compiler that checks them."""

import json
import re
import subprocess
from pathlib import Path
from urllib.request import url2pathname

import pytest

from tests.shared.programs import ROOT

FOLDER = ROOT / "tests/javascript"
COMPILER = FOLDER / "node_modules/.bin/tsc"
SCRIPTS = ROOT / "fotismos/reports/page/templates/viewer"

JSON = re.compile(r'<script type="application/json"[^>]*>(.*?)</script>', re.DOTALL)


@pytest.mark.skipif(not COMPILER.exists(), reason="npm ci --prefix tests/javascript")
def test_the_types_of_data_are_those_of_what_python_writes(report, tmp_path):
    """And the compiler finds data of other types, which are all that it finds."""
    html = Path(url2pathname(report.url.removeprefix("file://"))).read_text()
    (text,) = JSON.findall(html)
    scenes = json.loads(text)["scenes"]
    for part in ("terms", "live"):
        assert {bool(scene.get(part) and scene[part]["grid"]) for scene in scenes} == {True, False}
    for part in ("board", "regions", "failed"):
        assert any(scene.get(part) for scene in scenes)
    other = json.loads(text) | {"epsilon": "1"}
    del other["scenes"][0]["board"]["hybrids"][0]["mean"]
    for name, data in (("written", text), ("other", json.dumps(other))):
        (tmp_path / f"{name}.js").write_text(f"/** @type {{Page}} */ const {name} = {data};")
    project = {
        "extends": str(FOLDER / "tsconfig.json"),
        "include": [str(SCRIPTS / "*.js"), "written.js", "other.js"],
    }
    (tmp_path / "tsconfig.json").write_text(json.dumps(project))
    words = [str(COMPILER), "--project", str(tmp_path)]
    said = subprocess.run(words, capture_output=True, text=True, timeout=120, cwd=tmp_path).stdout
    assert "Type 'string' is not assignable to type 'number'" in said
    assert "Property 'mean' is missing" in said
    errors = [line for line in said.splitlines() if not line.startswith(" ")]
    assert [line for line in errors if not line.startswith("other.js(")] == []


def test_npm_packages_have_one_version_and_a_hash_and_no_address():
    wanted = json.loads((FOLDER / "package.json").read_text())["dependencies"]
    text = (FOLDER / "package-lock.json").read_text()
    packages = {name: each for name, each in json.loads(text)["packages"].items() if name}
    for name, version in wanted.items():
        assert packages[f"node_modules/{name}"]["version"] == version
    assert all(each["integrity"].startswith("sha512-") for each in packages.values())
    assert "://" not in text
