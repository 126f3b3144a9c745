"""The Python of the documentation runs as it stands there."""

import doctest
import re

import pytest

import fieldgap as fg


def fences(page):
    return re.findall(r"^```python\n(.*?)^```$", page.read_text(), flags=re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize("page", ["docs/python.md", "python/README.md"])
def test_the_examples_of_a_page_run(repository, folder, page):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    names = {}
    examples = fences(repository / page)
    assert examples
    for example in examples:
        # The scan of the tests stands for that of the README.
        exec(compile(example.replace("out/thesis-focus", str(folder)), page, "exec"), names)
    pyplot.close("all")
    assert names["field"].shape == (201, 201)


def test_the_example_of_the_package_runs():
    tried = doctest.testmod(fg)
    assert tried.attempted > 3 and tried.failed == 0
