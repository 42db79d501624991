"""The first line of a command's page: its name, version and date, and links to what exists."""

import re

from fotismos.heuristic.program import __version__
from fotismos.reports.page.templating import head


def test_a_page_links_the_comparison_and_the_other_page_of_its_scene_if_they_exist(tmp_path):
    for kind in ("cost", "fit"):
        (tmp_path / kind / "my scene").mkdir(parents=True)
    folder = tmp_path / "cost/my scene"
    alone = head("cost", folder, "my scene")
    assert (alone["home"], alone["links"]) == ("", {})
    assert (alone["command"], alone["version"]) == ("cost", __version__)
    assert re.fullmatch(r"\d{4}-\d\d-\d\d", alone["date"])
    (tmp_path / "index.html").touch()
    (tmp_path / "fit/my scene/index.html").touch()
    found = head("cost", folder, "my scene")
    assert found["links"] == {"Fit": "../../fit/my scene/index.html"}
    assert (folder / found["home"]).resolve() == tmp_path / "index.html"
    (tmp_path / "my scene").mkdir()
    (tmp_path / "my scene/comparison.json").touch()
    links = head("cost", folder, "my scene")["links"]
    assert links["Comparison"] == "../../index.html#scene=my-scene"
    assert (folder / links["Fit"]).exists()
    assert "Comparison" not in head("audit", tmp_path / "audit/my scene")["links"]
