"""What compares two pictures, records and shows it loads neither Mitsuba nor Dr.Jit nor LLVM."""

import json

import mitsuba as mi
import numpy as np

from tests.shared import records
from tests.shared.programs import python
from tests.shared.two_pictures import measured

ROOTS = (
    "fotismos.comparisons.departure.definitions",
    "fotismos.reports.cli",
    "fotismos.reports.run.pictures",
    "fotismos.reports.commands.cost",
    "fotismos.reports.run.cost_files",
)
"""They import the others."""

WITHOUT = """
import sys
sys.modules["mitsuba"] = None
sys.modules["drjit"] = None
"""

IMPORTED = (
    WITHOUT
    + """
from importlib import import_module
for name in sys.argv[1:]:
    import_module(name)
print(open("/proc/self/maps").read().count("libLLVM"))
"""
)

JUDGED = (
    WITHOUT
    + """
import numpy as np
y, x = np.mgrid[0:24, 0:32] / 32
image = np.stack((0.1 + x, 0.5 * y + 0.2, np.abs(x - y)), axis=-1)
np.save("truth.npy", image)
np.save("mine.npy", 1.1 * image)
from fotismos.reports.cli import main
sys.argv[1:] = ["cost", "-r", "truth.npy", "--picture", "mine @ 2ms=mine.npy"]
main()
"""
)

COMMANDED = (
    WITHOUT
    + """
import numpy as np
rng = np.random.default_rng(0)
truth = np.full((24, 32, 3), 0.4)
np.save("truth.npy", truth * (1 + 0.05 * rng.standard_normal(truth.shape)))
np.save("mine.npy", 1.3 * truth * (1 + 0.05 * rng.standard_normal(truth.shape)))
from fotismos.reports.cli import main
sys.argv[1:] = ["compare", "--reference", "truth.npy", "--image", "mine.npy"]
try:
    main()
finally:
    print("loaded:", {"scipy", "colour", "altair", "pandas", "pyarrow"} & {*sys.modules})
"""
)

COMPARED = (
    WITHOUT
    + """
import json
from pathlib import Path
import numpy as np
from fotismos.heuristic.program import PICTURE_LIBRARIES, versions
from fotismos.reference.records import Machine
from fotismos.comparisons.departure.metrics import drawn
from fotismos.comparisons.departure.statistics import summarise_log2_luminance
from fotismos.comparisons.picture_files import read_file
from fotismos.reference.records import plain, to_json
from fotismos.reports import verdict
from fotismos.reports.files import images
from fotismos.reports.page import embedding, page
from fotismos.reports import tables
from tests.shared import records
from tests.shared.two_pictures import measured, passes

test, reference, _ = passes()
images.write_exr(Path("x.exr"), {"rgb": test[0]}, {})
read = read_file("x.exr:rgb").image
counted = np.ones(read.shape[:2], bool)
layers = {"heuristic": read, "reference": reference[0], "reference_stderr": 0 * read}
layers |= {name: metric(read, reference[0]) for name, metric in drawn().items()}
layers["significant"] = counted
embedded = embedding.embed(images.channels(layers), counted)
record = records.record()
html = page.render([records.view(json.loads(to_json(record)), embedded=embedded)])
found = measured()
found["read"] = float(np.abs(read - test[0]).max())
found["log2"] = summarise_log2_luminance(test[0], reference[0], counted)[0].mean
found["said"] = [verdict.about(record), *tables.summary([record]), html.count("page-data")]
found["versions"] = sorted(versions(PICTURE_LIBRARIES))
found["loaded"] = sorted(name for name in sys.modules if name.startswith(("mitsuba", "drjit")))
print(json.dumps(plain(found)))
"""
)


def test_modules_for_two_pictures_are_imported_without_mitsuba():
    done = python("-c", IMPORTED, *ROOTS)
    assert done.stdout == "0\n", done.stderr


def test_two_pictures_are_compared_without_large_libraries(tmp_path):
    """Each of them takes as long to import as the comparison."""
    done = python("-c", COMMANDED, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "loaded: set()" in done.stdout


def test_settings_are_judged_without_mitsuba(tmp_path):
    done = python("-c", JUDGED, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "mine passes at" in done.stdout
    assert (tmp_path / "out/cost/truth/index.html").exists()
    assert (tmp_path / "out/cost/truth/cost.svg").exists()


def test_two_pictures_are_measured_recorded_and_shown_without_mitsuba(rgb, tmp_path):
    done = python("-c", COMPARED, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    expected = measured(mi.TensorXd)
    assert expected["marked"][2] > 0
    for name, numbers in expected.items():
        is_single = name.endswith("flip")
        np.testing.assert_allclose(
            found[name], numbers, rtol=1e-4 if is_single else 1e-6, atol=1e-5, err_msg=name
        )
    assert found["read"] < 1e-3  # the file has half precision
    assert found["loaded"] == ["drjit", "mitsuba"]  # which are None
    assert {"OpenEXR", "colour-science", "numpy"} < set(found["versions"])
    assert records.record().scene in found["said"][0]
    assert found["said"][-1] > 0
