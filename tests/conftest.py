"""Shapes in annotations are checked at run time, in every module that is not compiled."""

import pkgutil
from pathlib import Path

from jaxtyping import install_import_hook

PACKAGE = Path(__file__).parents[1] / "vrdp_prob"
MODULES = [module.name for module in pkgutil.walk_packages([str(PACKAGE)], "vrdp_prob.") if not module.ispkg]
CHECKED = [name for name in MODULES if not name.endswith("_kernel") and not name.endswith("__main__")]

install_import_hook(CHECKED, "beartype.beartype")
