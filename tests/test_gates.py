"""Gates of `compare`: their three outcomes, exit codes, files, and words that are refused."""

from xml.etree import ElementTree

import click
import pytest
from msgspec import structs

from comparisons.departure.statistics import Between
from reports.ci import asked, gates, summaries
from tests import records


def judged(low, high, bound):
    """Return the states of both gates where both intervals are the same."""
    made = records.record()
    metric = structs.replace(
        made.metrics["dE2000"],
        low=low,
        high=high,
        visible_between={"2": Between(low=low, high=high)},
    )
    record = structs.replace(made, metrics=made.metrics | {"dE2000": metric})
    return [one.state for one in gates.Gates(bound, bound).judge([record])]


@pytest.mark.guarantee(
    "checks",
    "A gate fails only if the interval's lower end is above its bound.",
)
def test_a_gate_fails_only_where_noise_is_no_reason():
    assert judged(0.3, 0.5, bound=0.2) == ["failed"] * 2
    assert judged(0.3, 0.5, bound=0.4) == ["undetermined"] * 2
    assert judged(0.3, 0.5, bound=0.5) == ["passed"] * 2
    assert judged(0.3, 0.5, bound=0.3) == ["undetermined"] * 2


def test_no_bound_is_no_gate():
    assert gates.Gates().judge([records.record()]) == []
    (only,) = gates.Gates(visible=0.1).judge([records.record()])
    assert only.gate == "above ΔE2000 2"


@pytest.mark.parametrize(
    ("word", "share"), [("5%", 0.05), ("0%", 0), ("100 %", 1), (" 2.5% ", 0.025)]
)
def test_percentages_are_read(word, share):
    assert asked.Share().convert(word, None, None) == pytest.approx(share)


@pytest.mark.parametrize(
    "word", ["5", "0.05", "-1%", "101%", "nan%", "inf%", "%", "5%%", "5%x", ""]
)
def test_other_words_are_refused_with_an_example(word):
    with pytest.raises(click.BadParameter, match="from 0% to 100%, such as 5%"):
        asked.Share().convert(word, None, None)


@pytest.mark.parametrize(
    "words", [("--max-mean", "nan"), ("--max-mean", "-1"), ("--max-visible", "5")]
)
def test_bad_bounds_end_the_command_before_anything_is_rendered(run, scene_file, tmp_path, words):
    code, _, messages = run("compare", scene_file, "-o", tmp_path / "out", *words)
    assert code == 2
    assert words[0] in messages
    assert not (tmp_path / "out").exists()


def test_a_run_beyond_its_bounds_ends_with_1_and_says_so_everywhere(run, scene_file, tmp_path):
    out, junit, summary = tmp_path / "out", tmp_path / "new/j.xml", tmp_path / "new/s.md"
    words = ("compare", scene_file, "-o", out, "--spp", 4, "--no-why")
    code, printed, _ = run(
        *words, "--max-mean", 0.01, "--max-visible", "100%", "--junit", junit, "--summary", summary
    )
    assert code == 1
    assert "gates: 1 failed, 1 passed." in printed
    suite = ElementTree.parse(junit).getroot().find("testsuite")
    assert (suite.get("tests"), suite.get("failures")) == ("2", "1")
    assert "at most 0.0100 allowed" in suite.find("testcase/failure").get("message")
    text = summary.read_text(encoding="utf-8")
    assert "| failed |" in text
    assert "data:" not in text
    assert f"`{out / 'index.html'}`" in text
    # The scene is finished: it is judged again, not rendered; the summary goes on in its file.
    code, printed, _ = run(
        *words, "--max-mean", 100, "--summary", summary, "--link", "https://x.y/z"
    )
    assert (code, "gates: 1 passed." in printed) == (0, True)
    assert "[Pictures, maps and numbers](https://x.y/z)" in summary.read_text(encoding="utf-8")
    assert summary.read_text(encoding="utf-8").startswith(text)


def test_names_cannot_break_the_table():
    outcome = gates.Outcome("a|b <i>`x`\n", "mean", 1.0, 2.0, 1.5, 2.5, is_share=False)
    text = summaries.of_comparison([records.view(records.data())], [outcome], "p")
    assert r"| a\|b &lt;i>\`x\` | mean |" in text
