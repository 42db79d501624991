"""Results that are found again by a key of all that they depend on."""

import numpy as np
import pytest

from comparisons.store import Entry

RESULTS = {"r.json": {"rows": [1, 2.5, None, "ü"]}, "r.npz": {"sum": np.arange(6.0).reshape(2, 3)}}


@pytest.fixture(params=RESULTS)
def saved(request, tmp_path):
    """A file with a result."""
    entry = Entry(tmp_path / request.param, "key")
    entry.save(RESULTS[request.param])
    return entry


def test_a_result_is_found_again_by_its_key(saved):
    found = saved.load()
    assert list(found) == list(RESULTS[saved.path.name])
    for name, content in RESULTS[saved.path.name].items():
        np.testing.assert_array_equal(found[name], content)
    assert Entry(saved.path, "another").load() is None
    saved.remove()
    saved.remove()
    assert saved.load() is None


@pytest.mark.parametrize("damaged", [b"", b"[]", b"{}", b"3", b"\xff\xfe", None])
def test_a_damaged_file_is_no_result(saved, damaged):
    content = saved.path.read_bytes()
    saved.path.write_bytes(content[: len(content) // 2] if damaged is None else damaged)
    assert saved.load() is None


def test_a_result_is_replaced_atomically(saved, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr("json.dumps", lambda *_, **__: len(3))
        patch.setattr("numpy.lib.format.write_array", lambda *_, **__: len(3))
        with pytest.raises(TypeError):
            saved.save({"rows": []})
    assert saved.load() is not None
    assert [path.name for path in saved.path.parent.iterdir()] == [saved.path.name]
