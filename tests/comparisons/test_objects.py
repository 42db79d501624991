"""Which shape and which material carries the departure, and by which effect."""

from types import SimpleNamespace

import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.attribution import with_effects_named
from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.departure import regions
from fotismos.comparisons.options import Options
from fotismos.comparisons.records.departure import Region
from fotismos.comparisons.steps import steps
from fotismos.reference.records import Interval
from fotismos.reference.rendering.gbuffer import ObjectIds, gbuffer
from tests.shared import records
from tests.shared.parts import CENTRE, RADIUS, moved, shadowed


@pytest.fixture(scope="module")
def compared():
    case = open_case(shadowed(), Options.of({"resolution": (48, 48)}), "shadowed")
    found = compare(case.source, case.options, then=steps(why=True))
    return SimpleNamespace(found=found, record=found.record)


@pytest.mark.guarantee(
    "attribution", "Every shape and region has its share of the departure, and its cause."
)
def test_the_floor_carries_the_shadow_and_the_sphere_nothing(compared):
    record = compared.record
    floor, sphere = record.objects
    assert (floor.name, sphere.name) == ("floor", "sphere")
    assert (floor.material, sphere.material) == ("slate", "chalk")
    assert floor.share > 0.99
    assert floor.effect == "occlusion"
    assert sphere.share < 0.01
    assert sphere.effect is None
    assert record.regions
    assert {region.effect for region in record.regions} == {"occlusion"}


@pytest.mark.guarantee(
    "attribution", "What an effect removes on all shapes averages to what it removes."
)
def test_what_is_removed_on_shapes_averages_to_that_of_the_image(compared):
    why = compared.record.why
    pixels = [row.pixels for row in why.objects]
    assert sum(pixels) == compared.record.pixels.counted
    for place, one in enumerate(why.effects):
        removed = [row.removes[place].value for row in why.objects]
        assert np.average(removed, weights=pixels) == pytest.approx(one.removes.value)
    for row in why.objects:
        total = sum(removes.value for removes in row.removes) + row.left
        assert total == pytest.approx(row.departure)


def test_pixels_belong_to_the_surface_that_their_ray_meets(compared):
    """The sphere's are at its radius from its centre."""
    found, record = compared.found, compared.record
    distance = np.linalg.norm(found.images.position - CENTRE, axis=-1)
    on_sphere = found.images.counted & (abs(distance - RADIUS) < 1e-3)
    np.testing.assert_array_equal(found.images.objects == 1, on_sphere)
    sphere = record.objects[1]
    assert sphere.pixels == on_sphere.sum()
    rows, columns = np.nonzero(on_sphere)
    assert (sphere.x, sphere.y) == (columns.min(), rows.min())
    assert sphere.width == np.ptp(columns) + 1


def test_shares_and_pixels_add_up_to_the_whole(compared):
    record = compared.record
    for carriers in (record.objects, record.materials):
        assert sum(each.share for each in carriers) == pytest.approx(1)
        assert sum(each.pixels for each in carriers) == record.pixels.counted
        mean = sum(each.pixels * each.mean_dE2000 for each in carriers) / record.pixels.counted
        assert mean == pytest.approx(record.metrics["dE2000"].mean, rel=1e-5)


def test_an_instance_is_a_shape_of_its_own():
    scene = shadowed()
    sphere = scene.pop("sphere")
    scene["group"] = {"type": "shapegroup", "ball": sphere}
    for name, x in (("left", -1.0), ("right", 1.0)):
        group = {"type": "ref", "id": "group"}
        scene[name] = {"type": "instance", "to_world": moved((x, 0, 0)), "group": group}
    seen = gbuffer(mi.load_dict(scene), (32, 32))
    names = np.array(seen.shape.names)[seen.shape.places[seen.hit]]
    assert set(names) == {"left", "right", "floor"}
    at_left = seen.position[seen.hit][:, 0] < 0
    assert at_left[names == "left"].all()
    assert not at_left[names == "right"].any()
    materials = np.array(seen.bsdf.names)[seen.bsdf.places[seen.hit]]
    np.testing.assert_array_equal(materials == "slate", names == "floor")


def test_effects_are_taken_where_the_pixels_of_a_shape_lie():
    """In maps of half the size, whose left column is bright by shadow, the right one by gloss."""
    owners = ObjectIds(np.repeat([[0, 0, 1, 1]], 4, axis=0), ("left", "right"))
    error = np.where(owners.places, 5.0, 4.0)
    counted = np.ones((4, 4), bool)
    carriers, places = regions.find_objects(error, counted, owners)
    effects = {"shadow": np.array([[3.0, 0], [3, 0]]), "gloss": np.array([[0.0, 2], [0, 2]])}
    images = records.images(4, 4, objects=places, materials=places)
    boxes = [Region(x=x, y=1, width=2, height=2, share=0.5, mean_dE2000=1.0) for x in (0, 2)]
    record = records.record(objects=carriers, materials=carriers, regions=tuple(boxes))
    causes = SimpleNamespace(maps=effects, record=SimpleNamespace(objects=()))
    found = with_effects_named(records.Comparison(record, images), causes)
    assert {each.name: each.effect for each in found.objects} == {
        "left": "shadow",
        "right": "gloss",
    }
    assert [each.effect for each in found.regions] == ["shadow", "gloss"]
    near = Interval(value=2.0, low=1.5, high=2.5), Interval(value=1.8, low=1.3, high=2.3)
    causes.record.objects = (SimpleNamespace(name="left", removes=near),)
    found = with_effects_named(records.Comparison(record, images), causes)
    assert {each.name: each.effect for each in found.objects} == {
        "left": "shadow; gloss",
        "right": "gloss",
    }
    assert {each.name: each.effect for each in found.materials}["left"] == "shadow"
