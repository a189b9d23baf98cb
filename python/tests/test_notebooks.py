"""The notebooks of the documentation run from beginning to end."""

from __future__ import annotations

from pathlib import Path

import pytest
from conftest import ROOT

FOLDER = ROOT / "docs" / "notebooks"


@pytest.mark.parametrize("notebook", sorted(FOLDER.glob("*.ipynb")), ids=lambda notebook: notebook.stem)
@pytest.mark.filterwarnings("ignore")
def test_notebook(notebook: Path) -> None:
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    document = nbformat.read(notebook, as_version=4)
    nbclient.NotebookClient(document, timeout=600, resources={"metadata": {"path": str(FOLDER)}}).execute()
