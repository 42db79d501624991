"""Records: their published schemas, and which files are read."""

import jsonschema
import pytest

from fotismos.heuristic.errors import InputError
from fotismos.reference import records
from fotismos.reference.records import VERSION, Record
from fotismos.reports.schemas import __main__ as schemas
from tests.shared.schemas import FOLDER, schema


class Toy(Record):
    """A toy.

    It is small.

    Attributes
    ----------
    colour, sheen
        Of its skin, as
        :class:`tests.Skin`.
    """

    colour: str
    sheen: float = 0.0
    record_version: int = VERSION


def test_a_docstring_describes_the_attributes_in_the_schema():
    toy = schemas.schema(Toy)["$defs"]["Toy"]
    assert toy["description"] == "A toy. It is small."
    described = {name: field.get("description") for name, field in toy["properties"].items()}
    words = "Of its skin, as tests.Skin."
    assert described == {"colour": words, "sheen": words, "record_version": None}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("{", "not JSON"),
        ("[]", "array"),
        ('{"colour": "red"}', "of fotismos 0.1"),
        ('{"colour": "red", "record_version": 9}', "`record_version` is 9, not the number 4"),
        ('{"colour": "red", "record_version": "3"}', '`record_version` is "3", not the number 4'),
        ('{"colour": 5, "record_version": 3}', "got `int`"),
        ('{"colour": 5, "record_version": 2}', "(?<=json: )Expected `str`, got"),
        ('{"colour": "red", "size": 1, "record_version": 3}', "unknown field `size`"),
        ('{"rung": "red", "record_version": 2}', "version 2; version 3 calls rungs `methods`"),
        (100_000 * "[", "nested too deep"),
        (f'{{"colour": {10_000 * "1"}}}', "10000 digits"),
    ],
)
def test_what_is_not_such_a_record_is_refused(text, expected):
    with pytest.raises(InputError, match=f"^toy.json: .*{expected}"):
        records.read(Toy, text, "toy.json")


def test_a_record_of_version_2_in_which_nothing_changed_is_read():
    text = records.to_json(Toy(colour="red", sheen=0.5)).replace(
        '"record_version": 3', '"record_version": 2'
    )
    assert records.read(Toy, text, "toy.json") == Toy(colour="red", sheen=0.5)


@pytest.mark.parametrize("name", schemas.PUBLISHED)
def test_a_published_schema_is_that_of_its_type(name):
    jsonschema.Draft202012Validator.check_schema(schema(name))
    published = (FOLDER / f"{name}.schema.json").read_text()
    assert published == schemas.text(name), "run python -m fotismos.reports.schemas"


def test_every_published_schema_has_a_type():
    published = {path.name.removesuffix(".schema.json") for path in FOLDER.glob("*.json")}
    assert published == set(schemas.PUBLISHED)
