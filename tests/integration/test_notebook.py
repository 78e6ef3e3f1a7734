"""A notebook that is run without a browser: outputs as they are saved."""

import base64
import io

import numpy as np
import pytest

import voxdisplay as vd

pytest.importorskip("anywidget", reason="needs the extra notebook")
nbformat = pytest.importorskip("nbformat", reason="needs nbclient")
nbclient = pytest.importorskip("nbclient", reason="needs nbclient")
pytest.importorskip("ipykernel", reason="needs a kernel for notebooks")
Image = pytest.importorskip("PIL.Image", reason="needs the extra view")

VIEW = "application/vnd.jupyter.widget-view+json"
STATE = "application/vnd.jupyter.widget-state+json"
SPHERE = 'vd.Sphere(center=(8, 9, 7), radius=4), color="gold"'
CELLS = [
    f"import voxdisplay as vd\nframe = vd.Frame((16, 16, 16))\nframe.draw({SPHERE})\nframe.show()",
    """scene = vd.read_scene('''{"size": [16, 16, 16], "duration": 0.5, "fps": 10, "objects": [
    {"type": "sphere", "center": [8, 8, "4 + 10*time"], "radius": 3}]}''')
scene.show()""",
    'display = vd.open("sim:?size=16x16x16")\ndisplay.show()\ndisplay.show()',
    f"""import threading
shown = display.frame()
shown.draw({SPHERE})
display.present(shown)
display.close()
next(each for each in threading.enumerate() if each.name == "notebook view").join()""",
]


def png(cell, number=0):
    data = base64.b64decode(cell.outputs[number].data["image/png"])
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int)


@pytest.fixture(scope="module")
def notebook(tmp_path_factory):
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(text) for text in CELLS])
    folder = tmp_path_factory.mktemp("notebook")
    client = nbclient.NotebookClient(
        notebook, timeout=120, kernel_name="python3", resources={"metadata": {"path": str(folder)}}
    )
    client.execute()
    return notebook


def states(notebook):
    """Return the states of the views, by the ids of their models."""
    kept = notebook.metadata.widgets[STATE]["state"]
    return {model: each["state"] for model, each in kept.items() if "page" in each["state"]}


def test_each_show_is_a_view_with_a_png(notebook):
    models = states(notebook)
    for cell, count in zip(notebook.cells, (1, 1, 2, 0), strict=True):
        assert len(cell.outputs) == count
        for number, output in enumerate(cell.outputs):
            assert output.output_type == "display_data"
            assert output.data[VIEW]["model_id"] in models
            assert png(cell, number).max() > 50
    live = [output.data[VIEW]["model_id"] for output in notebook.cells[2].outputs]
    assert live[0] == live[1], "another call shows the same view"
    assert len(models) == 3


def test_the_png_of_a_frame_is_its_picture(notebook):
    frame = vd.Frame((16, 16, 16))
    frame.draw(vd.Sphere(center=(8, 9, 7), radius=4), color="gold")
    meant = np.asarray(Image.open(io.BytesIO(frame._repr_png_())).convert("RGB"))
    assert (png(notebook.cells[0]) == meant).all()


def test_of_a_live_view_the_last_picture_is_saved(notebook):
    for number in (0, 1):
        assert (png(notebook.cells[2], number) == png(notebook.cells[0])).all()
    (live,) = [state for state in states(notebook).values() if "state" in state]
    assert live["state"] == "sim:?size=16x16x16 is closed: last picture"
