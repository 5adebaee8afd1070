from covertool.errors import CovertoolError, CrsError


def test_an_error_is_told_in_exactly_three_lines():
    error = CovertoolError("broken\nin two", "file\n.gpkg", "mend\nit")
    assert str(error).splitlines() == [
        "error: broken in two",
        "where: file .gpkg",
        "mend:  mend it",
    ]


def test_every_error_keeps_its_three_parts():
    error = CrsError("a", "b", "c")
    assert (error.what, error.where, error.mend) == ("a", "b", "c")
