"""The lists of slow and of long tests name tests that are there, and every folder has fast ones."""

import ast
import functools

from tests.cases.places import ROOT
from tests.conftest import long_tests, slow_tests


def functions_of(file: str) -> set[str]:
    body = ast.parse((ROOT / file).read_text(encoding="utf-8")).body
    return {n.name for n in body if isinstance(n, ast.FunctionDef) and n.name.startswith("test_")}


def folder_of(test: str) -> str:
    return test.partition("::")[0].rpartition("/")[0]


FILES = {path.relative_to(ROOT).as_posix() for path in ROOT.glob("tests/**/test_*.py")}


@functools.cache
def every_test() -> set[str]:
    return {f"{file}::{name}" for file in FILES for name in functions_of(file)}


def test_slow_tests_are_there():
    listed = slow_tests()
    assert len(listed) == len(set(listed))
    assert not set(listed) - every_test() - FILES


def test_long_tests_are_there_and_each_has_shorter_ones_in_its_folder():
    listed = long_tests()
    assert len(listed) == len(set(listed))
    functions = {test.partition("[")[0] for test in listed}
    assert not functions - every_test()
    whole = {test for test in listed if "[" not in test}
    shorter = {folder_of(test) for test in every_test() - whole}
    assert {folder_of(test) for test in functions} <= shorter


def test_every_folder_of_tests_has_fast_ones():
    slow = set(slow_tests())
    tests = every_test()
    fast = {test for test in tests if slow.isdisjoint((test, test.partition("::")[0]))}
    assert {folder_of(test) for test in tests} == {folder_of(test) for test in fast}
