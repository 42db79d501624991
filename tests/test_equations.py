from heuristic import equations


def test_every_equation_has_exactly_one_home_or_a_reason():
    homes = equations.homes()
    assert set(homes) <= set(equations.NUMBERS), "a docstring claims an equation that is not there"
    for number in equations.NUMBERS:
        names = [name for name, _ in homes.get(number, ())]
        if number in equations.WITHOUT_HOME:
            assert names == [], f"{number} has a reason for having no home, and a home"
        else:
            assert len(names) == 1, f"{number} has the homes {names}"


def test_claims_are_read_from_the_beginning_of_a_docstring():
    def home():
        """Equations 8.5, 6.6-6.8: something."""

    def no_home():
        """Like equation 8.5: something."""

    assert equations.claims(home) == ("8.5", "6.6", "6.7", "6.8")
    assert equations.claims(no_home) == ()


def test_the_index_says_something_about_each_equation():
    entries = equations.index()
    assert [entry.number for entry in entries] == list(equations.NUMBERS)
    assert all(entry.meaning for entry in entries)
