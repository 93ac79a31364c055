"""Shapes in annotations are checked at run time, in every module that is not compiled."""

from importlib import import_module
from pathlib import Path

import pytest
from hypothesis import settings
from jaxtyping import install_import_hook
from shape_checker import check_now_and_then

ROOT = Path(__file__).parents[1]
MODULES = [".".join(path.relative_to(ROOT).with_suffix("").parts) for path in sorted(ROOT.glob("vrdp_prob/**/*.py"))]
CHECKED = [name for name in MODULES if not name.endswith(("_kernel", "__init__"))]

check_now_and_then()
install_import_hook(CHECKED, "shape_checker.check")

# how long an example takes says nothing on a busy machine, and compiles or builds a grammar the first time
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")


def pytest_configure(config: pytest.Config) -> None:
    """Have ArviZ note its warning of the day before workers start: two that import it at once take the file from
    each other, and one of them fails."""
    if not hasattr(config, "workerinput"):
        import_module("arviz")


SHARED_DATA = Path(__file__).parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of the measured and simulated data sets beside the project."""
    if not SHARED_DATA.is_dir():
        pytest.skip(f"the data sets are not beside the project (no folder {SHARED_DATA.name} in ../shared)")
    return SHARED_DATA
