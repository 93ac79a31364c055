"""Shapes in annotations are checked at run time, in every module that is not compiled."""

import pkgutil
from pathlib import Path

import pytest
from jaxtyping import install_import_hook

PACKAGE = Path(__file__).parents[1] / "vrdp_prob"
MODULES = [module.name for module in pkgutil.walk_packages([str(PACKAGE)], "vrdp_prob.") if not module.ispkg]
CHECKED = [name for name in MODULES if not name.endswith("_kernel") and not name.endswith("__main__")]

install_import_hook(CHECKED, "beartype.beartype")

SHARED_DATA = Path(__file__).parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of the measured and simulated data sets beside the project."""
    if not SHARED_DATA.is_dir():
        pytest.skip(f"the data sets are not beside the project (no folder {SHARED_DATA.name} in ../shared)")
    return SHARED_DATA
