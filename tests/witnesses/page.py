"""The tables of docs/witnesses.md, made from the cases' own declarations and by running them."""

import ast
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from comparisons.gallery.builtin import SCENES
from reports.terminal import tables
from tests.witnesses import test_closed_forms, test_povray
from tests.witnesses.witness import Witness, deviation

TESTS = Path(__file__).parents[1]

ELSEWHERE = (
    "test_sampler::test_the_reference_is_right_inside_a_bright_sphere",
    "test_physics::test_a_diffuse_plane_under_a_point_light",
    "test_physics::test_a_diffuse_sphere_under_a_directional_light",
    "test_physics::test_a_diffuse_sphere_in_a_constant_environment",
    "test_physics::test_the_spot_of_an_area_light_is_right_in_the_far_field",
    "test_physics::test_white_diffuse_light_of_unit_intensity_has_the_value_1",
    "test_pairing::test_a_matched_roughplastic_has_the_albedos_that_it_was_matched_to",
    "test_pairing::test_the_albedo_of_the_lobe",
    "test_audit::test_the_textbooks_lobes_return_what_a_quadrature_finds",
    "test_audit::test_roughplastic_loses_light_is_reciprocal_and_has_a_wrong_derivative",
)
"""Other tests that hold something against a closed form or an independent quadrature."""


def closed_forms() -> Iterator[str]:
    """Yield the table of the reference against closed forms, with what was measured."""
    rows = [(witness.name, _measured(witness)) for witness in test_closed_forms.WITNESSES]
    return tables.markdown([("Case", "Reference less form, %"), *rows], right=1)


def figures() -> Iterator[str]:
    """Yield how far the kernel's figures are from POV-Ray's."""
    found = [_figure(name) for name in test_povray.FIGURES + test_povray.OTHERS]
    pixels, alone, largest = zip(*found, strict=True)
    yield (
        f"In {len(found)} figures both see {min(pixels):,} to {max(pixels):,} pixels, and one alone"
        f" sees {max(alone)} at most. The largest difference is {max(largest):.2f} of a rounding."
    )


def elsewhere() -> Iterator[str]:
    """Yield the list of the other tests; a KeyError if one no longer exists."""
    for entry in ELSEWHERE:
        module, name = entry.split("::")
        tree = ast.parse((TESTS / f"{module}.py").read_text(encoding="utf-8"))
        found = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
        words = found[name].name.removeprefix("test_").replace("_", " ")
        yield f"- [{words}](../tests/{module}.py)"


def _measured(witness: Witness) -> str:
    found = deviation(witness)
    spread = 1.96 * found.standard_error[0] + witness.form_error
    return f"{100 * found.value[0]:+.3f}±{100 * spread:.3f}"


def _figure(name: str) -> tuple[int, int, float]:
    with TemporaryDirectory() as folder:
        kernel, witness, alone = test_povray.seen_by_both(SCENES[name].make(), Path(folder))
    rounding = test_povray.HALF * kernel + test_povray.SINGLE
    largest = float(np.max(np.abs(kernel - witness) / rounding))
    return len(kernel), alone, largest
