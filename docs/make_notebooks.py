"""Executes the notebooks of this folder and writes them with what they print and draw: `make notebooks`.

python docs/make_notebooks.py [NAME ...]
"""

import sys
from pathlib import Path

import nbformat
from nbclient import NotebookClient

from simulator.atomic_files import atomic_write

NOTEBOOKS = Path(__file__).resolve().parent / "notebooks"
TIMEOUT_S = 300  # of a cell


def executed(path: Path) -> nbformat.NotebookNode:
    """Return a notebook with the outputs of this run. Raises CellExecutionError of nbclient where a cell fails."""
    notebook = nbformat.read(path, as_version=4)
    client = NotebookClient(notebook, timeout=TIMEOUT_S, kernel_name="python3", record_timing=False)
    client.execute(cwd=str(path.parent))
    for output in [one for cell in notebook.cells for one in cell.get("outputs", [])]:
        data = output.get("data", {})
        if len(data) > 1:
            data.pop("text/plain", None)  # says the same in more letters
    notebook.metadata = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
    notebook.metadata["language_info"] = {"name": "python"}
    return notebook


def printed(notebook: nbformat.NotebookNode) -> list[str]:
    """Return what the cells of a notebook print, cell by cell."""
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    return ["".join(one.text for one in cell.outputs if one.output_type == "stream") for cell in cells]


def main(names: list[str]) -> None:
    """Execute the notebooks of these names, or all."""
    for path in sorted(NOTEBOOKS.glob("*.ipynb")):
        if names and path.stem not in names:
            continue
        text = nbformat.writes(executed(path))
        with atomic_write(path) as temporary:
            Path(temporary).write_text(text.rstrip("\n") + "\n", encoding="utf-8")
        print(path)


if __name__ == "__main__":
    main(sys.argv[1:])
