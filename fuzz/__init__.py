"""Fuzzing: what covertool reads, driven by atheris; the corpora are replayed by the tests."""
