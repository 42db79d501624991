"""The published schemas are those of the types."""

import jsonschema
import pytest

from reports.schemas import __main__ as schemas
from tests.schemas import FOLDER, schema


@pytest.mark.parametrize("name", schemas.PUBLISHED)
def test_a_published_schema_is_that_of_its_type(name):
    jsonschema.Draft202012Validator.check_schema(schema(name))
    published = (FOLDER / f"{name}.schema.json").read_text(encoding="utf-8")
    assert published == schemas.text(name), "run python -m reports.schemas"


def test_every_published_schema_has_a_type():
    published = {path.name.removesuffix(".schema.json") for path in FOLDER.glob("*.json")}
    assert published == set(schemas.PUBLISHED)
