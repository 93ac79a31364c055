"""What pages are made of: templates and assets of this package, and those that others add."""

from importlib import resources

import jinja2
from markupsafe import Markup


def environment(*packages: str) -> jinja2.Environment:
    """Templates of some packages, then those of the report, with everything escaped that is put into them."""
    loaders = [jinja2.PackageLoader(package, "templates") for package in (*packages, __package__)]
    return jinja2.Environment(
        loader=jinja2.ChoiceLoader(loaders),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )


def asset(name: str) -> Markup:
    """Text of a style sheet or script, to stand in a page as it is."""
    return Markup((resources.files(__package__) / "assets" / name).read_text(encoding="utf-8"))
