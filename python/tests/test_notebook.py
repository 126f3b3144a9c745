"""The example notebook runs, and shows what it says."""

import base64

import pytest


@pytest.fixture(scope="module")
def executed(repository, tmp_path_factory):
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    notebook = nbformat.read(repository / "python/examples/first-picture.ipynb", as_version=4)
    nbformat.validate(notebook)
    nbclient.NotebookClient(notebook, timeout=120, resources={"metadata": {"path": tmp_path_factory.mktemp("notebook")}}).execute()
    return notebook


def outputs(notebook, kind):
    shown = (output.get("data", {}) for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs)
    return [data[kind] for data in shown if kind in data]


def test_the_first_cell_is_five_lines_and_a_picture(executed):
    first = next(cell for cell in executed.cells if cell.cell_type == "code")
    assert len(first.source.splitlines()) == 5
    (picture,) = [output.data["image/png"] for output in first.outputs if "image/png" in output.get("data", {})]
    assert base64.b64decode(picture).startswith(b"\x89PNG")


def test_record_comparison_and_diagnosis_are_shown(executed):
    pages = outputs(executed, "text/html")
    assert len(pages) == 4
    assert "1875 in V" in pages[0] and "warm air" in pages[1] and "sound-speed" in pages[3]
    assert all("data:image/png;base64," in page for page in (pages[1], pages[3]))


def test_the_speed_of_sound_is_found(executed):
    (text,) = [output.text for cell in executed.cells if cell.cell_type == "code" for output in cell.outputs if output.output_type == "stream"]
    found, error, true = (float(text.split(word)[1].split()[0]) for word in ("found", "±", "true"))
    assert abs(found - true) < 4 * error < 2.0
