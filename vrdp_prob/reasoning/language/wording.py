"""Wordings: English for meanings, as templates in TOML files.

A file has one table for each kind of phrase and grammatical form, `[moment.when]`, with a list of templates for each
production. In a template `{event.clause}` is a slot in a form, `[enters|comes into]` a choice, `<hits>` a choice that
the table `[choices]` defines, and what is left empty vanishes. The first template and the first of each choice are
the plain ones. A file may begin with `builds_on = "other"`: phrases that it does not word are worded as there.
"""

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from vrdp_prob.reasoning.language.meaning import PRODUCTIONS, Meaning, slots
from vrdp_prob.reasoning.language.words import split

_CHOICE = re.compile(r"\[([^\[\]]*)\]")
_NAMED_CHOICE = re.compile(r"<(\w+)>")
_SLOT = re.compile(r"\{(\w+)\.(\w+)\}")
_WHOLE = {"question": "asked", "choice": "stated"}


@dataclass(frozen=True)
class Wordings:
    """Templates of one file and of those that it builds on.

    Parameters
    ----------
    templates
        Lists of templates by kind of phrase, form and production.
    choices
        What `<name>` stands for in a template.
    nonsense
        Templates of texts that no program answers; slots name kinds: `{object.the}`.
    """

    templates: Mapping[tuple[str, str, str], tuple[str, ...]]
    choices: Mapping[str, tuple[str, ...]]
    nonsense: tuple[str, ...] = ()

    def productions(self, kind: str) -> tuple[str, ...]:
        """What can be said of a whole text: the productions of `question` or `choice` that have templates."""
        return tuple(name for name in PRODUCTIONS[kind] if self.of(kind, name))

    def of(self, kind: str, production: str) -> tuple[str, ...]:
        """The templates of a whole text."""
        return self.templates.get((kind, _WHOLE[kind], production), ())

    def say(self, meaning: Meaning, generator: np.random.Generator | None = None, form: str | None = None) -> str:
        """A meaning in English.

        Parameters
        ----------
        meaning
            What to say.
        generator
            Picks among the wordings; the plain ones where it is None.
        form
            Grammatical form; by default that of a whole question or choice.
        """
        return self.fill(self.template(meaning, generator, form), meaning.parts, generator)

    def template(self, meaning: Meaning, generator: np.random.Generator | None = None, form: str | None = None) -> str:
        """One of the templates of a meaning, its choices made."""
        key = (meaning.kind, form or _WHOLE[meaning.kind], meaning.production)
        return self.settle(_pick(self.templates[key], generator), generator)

    def fill(self, template: str, parts: Mapping[str, Meaning], generator: np.random.Generator | None = None) -> str:
        """A template whose choices are made, with words in its slots."""
        return _tidy(_SLOT.sub(lambda match: self.say(parts[match[1]], generator, match[2]), template))

    def settle(self, template: str, generator: np.random.Generator | None) -> str:
        """A template with its choices made."""
        named = self._spelled_out(template)
        while _CHOICE.search(named):
            named = _CHOICE.sub(lambda match: _pick(tuple(match[1].split("|")), generator), named)
        return named

    def _spelled_out(self, template: str) -> str:
        """A template with its named choices in place."""
        return _NAMED_CHOICE.sub(lambda match: f"[{'|'.join(self.choices[match[1]])}]", template)

    def words_of(self, template: str) -> frozenset[str]:
        """All words that a template can have of its own."""
        named = self._spelled_out(template)
        return frozenset(split(re.sub(r"[\[\]|]", " ", _SLOT.sub(" ", named))))

    def variants(self, template: str) -> frozenset[str]:
        """The skeletons that the choices of a template allow."""
        named = self._spelled_out(template)
        match = _CHOICE.search(named)
        if match is None:
            return frozenset([skeleton(named)])
        before, after = named[: match.start()], named[match.end() :]
        return frozenset[str]().union(*(self.variants(f"{before}{option}{after}") for option in match[1].split("|")))


def skeleton(template: str) -> str:
    """What makes a template a template: its own words in lower case and its slots, whatever their form."""
    pieces = re.findall(r"\{\w+|[a-z0-9]+", re.sub(r"\.\w+\}", " ", template.lower()))
    return " ".join(pieces)


@cache
def wordings(name: str) -> Wordings:
    """The wordings of one of the files `wordings/*.toml`.

    Raises
    ------
    ValueError
        If a template leaves out a slot of its production or has one that it does not have.
    """
    document = tomllib.loads((files(__package__) / "wordings" / f"{name}.toml").read_text(encoding="utf-8"))
    base = wordings(document.pop("builds_on")) if "builds_on" in document else Wordings({}, {})
    choices = {key: tuple(value) for key, value in document.pop("choices", {}).items()}
    nonsense = tuple(document.pop("nonsense", ()))
    templates = {
        (kind, form, production): tuple(texts)
        for kind, forms in document.items()
        for form, productions in forms.items()
        for production, texts in productions.items()
    }
    for (kind, form, production), texts in templates.items():
        for text in texts:
            if {slot for slot, _ in _SLOT.findall(text)} != set(slots(kind, production)):
                raise ValueError(f"wordings/{name}.toml, [{kind}.{form}] {production}: '{text}' has other slots")
    kept = {key: texts for key, texts in base.templates.items() if key[0] not in _WHOLE}
    return Wordings(kept | templates, dict(base.choices) | choices, nonsense)


def _pick(options: tuple[str, ...], generator: np.random.Generator | None) -> str:
    return options[0] if generator is None else options[int(generator.integers(len(options)))]


def _tidy(text: str) -> str:
    return re.sub(r"\s+", " ", text).replace(" ,", ",").replace(" ?", "?").replace(" 's", "'s").strip()
