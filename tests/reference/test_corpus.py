"""Every plugin that Mitsuba ships is rendered in both halves, or refused for Mitsuba's own reason.

The scenes of `tests/corpus` are small and one feature each; the files that they read are made by
`tests.shared.corpus_files`.
"""

import re
import shutil
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.compare import compare
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.heuristic.errors import InputError
from fotismos.reference import Source
from fotismos.reference.planning.plan import wants_spectra
from tests.shared import corpus_files

CORPUS = Path(__file__).parents[1] / "corpus"

REFUSED = {
    "emitter-timed-sunsky",  # its table of the sun's path cannot be read inside a kernel
    "refused-missing",
    "refused-parameter",
    "refused-texture",
    "refused-unknown",
}
"""Scenes that Mitsuba itself does not render."""

IN_EVERY_RUN = (
    "bsdf-blendbsdf", "bsdf-conductor", "bsdf-mask", "bsdf-normalmap", "bsdf-principled",
    "emitter-area", "emitter-envmap", "film-crop", "medium-homogeneous", "sensor-several",
    "shape-instance", "shape-merge",
)  # fmt: skip
"""What the project's code treats in its own way goes all through `compare`; with --all the halves
of the rest are rendered."""

EXCEPTIONS = {
    "measured_polarized": "only polarised variants have it",
    "blender": "reads a pointer into a running Blender",
    "rawconstant": "made by Mitsuba's parser, from a colour that is no spectrum",
    "srgb": "made by Mitsuba's parser, from RGB",
    "uniform": "made by Mitsuba's parser, from a number",
    "irregular": "made by Mitsuba's parser, from a tabulated spectrum",
    "regular": "made by Mitsuba's parser, from an evenly tabulated spectrum",
}


NAMES = sorted(path.stem for path in CORPUS.glob("*.xml"))


@pytest.fixture(scope="module")
def corpus(tmp_path_factory):
    """A folder with the scenes and the files that they read."""
    mi.set_variant("llvm_ad_rgb")
    folder = tmp_path_factory.mktemp("corpus")
    shutil.copytree(CORPUS, folder, dirs_exist_ok=True)
    corpus_files.write(folder)
    return folder


@pytest.fixture(autouse=True)
def silent():
    """Mitsuba's own warnings, such as that a filter is wider than a meter's pixel, are not ours."""
    mi.set_variant("llvm_ad_rgb")
    level = mi.log_level()
    mi.set_log_level(mi.LogLevel.Error)
    yield
    mi.set_log_level(level)


def variant_of(path):
    mi.set_variant("llvm_ad_rgb")
    try:
        return (
            "llvm_ad_spectral" if wants_spectra(Source(path.stem, path).parse()) else mi.variant()
        )
    except InputError:
        return mi.variant()


def render(scene):
    return scene.integrator().render(scene, spp=1)  # mi.render hides what went wrong


def reason_of_mitsuba(path):
    """Return why Mitsuba does not render a scene, without the places in its own sources."""
    with pytest.raises(RuntimeError) as refusal:
        render(mi.load_file(str(path)))
    return unnumbered(refusal).rpartition("] ")[2].strip().splitlines()[0]


def unnumbered(refusal):
    """Return a message without Dr.Jit's numbers of variables."""
    return re.sub(r"\(r\d+\)", "", str(refusal.value))


def require_pictures(*images):
    for image in images:
        assert np.isfinite(image).all()
        assert image.max() > 0, "a black picture compares nothing"


@pytest.mark.parametrize("name", sorted(REFUSED))
def test_a_scene_is_refused_as_mitsuba_refuses_it(name, rgb, corpus):
    """In Mitsuba's words, or in plainer ones about the same names."""
    path = corpus / f"{name}.xml"
    mi.set_variant(variant_of(path))
    with pytest.raises(InputError) as refusal:
        compare(Source(name, path), Options(spp=4))
    reason = reason_of_mitsuba(path)
    names = re.findall(r'"([^"]+)"', reason)
    said = unnumbered(refusal)
    assert reason in said or (names and all(name in said for name in names))


ENDS_PYTHON = ("sensor-batch",)
"""Rendering these aborts inside Dr.Jit, as it did in 0.2; commands lose the scene alone."""


@pytest.mark.parametrize("name", IN_EVERY_RUN)
def test_a_scene_is_compared(name, rgb, corpus):
    path = corpus / f"{name}.xml"
    mi.set_variant(variant_of(path))
    images = compare(Source(name, path), Options(spp=4)).images
    require_pictures(images.heuristic, images.reference)


@pytest.mark.thorough
@pytest.mark.parametrize("name", sorted({*NAMES} - {*IN_EVERY_RUN, *REFUSED, *ENDS_PYTHON}))
def test_the_halves_of_any_other_scene_are_rendered(name, rgb, corpus):
    path = corpus / f"{name}.xml"
    mi.set_variant(variant_of(path))
    ready = prepare(Source(name, path), Options(spp=64))  # a meter has one pixel
    require_pictures(*(np.array(half.render(0)) for half in (ready.heuristic, ready.reference)))


def test_the_corpus_covers_all_plugins_but_those_that_it_says():
    shipped = {path.stem for path in (Path(mi.__file__).parent / "plugins").glob("*.so")}
    used = set()
    for path in CORPUS.glob("*.xml"):
        used |= set(re.findall(r'type="(\w+)"', path.read_text()))
    assert shipped - used == set(EXCEPTIONS)
