"""Learned concepts as a file: plain tensors, words and facts, no code."""

import json
from pathlib import Path

import torch

from vrdp_prob.concepts.perceived.concepts import Concepts, Lessons
from vrdp_prob.concepts.perceived.network import ConceptNetwork
from vrdp_prob.concepts.perceived.vocabulary import Vocabulary
from vrdp_prob.errors import InputError
from vrdp_prob.files import write_atomically

FORMAT, FORMAT_VERSION = "vrdp-prob concepts", 1


def write_concepts(path: Path | str, concepts: Concepts) -> None:
    """Write concepts.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    stored = {
        "format": FORMAT,
        "version": FORMAT_VERSION,
        "words": json.dumps({name: list(words) for name, words in concepts.vocabulary.values.items()}),
        "lessons": json.dumps(concepts.lessons.to_document()),
        "networks": [
            {name: value.detach().cpu() for name, value in network.state_dict().items()}
            for network in concepts.networks
        ],
    }
    # Given a path, torch names the archive inside after it, and refuses a hidden file without a suffix.
    with write_atomically(path) as temporary, temporary.open("wb") as stream:
        torch.save(stored, stream)


def read_concepts(path: Path | str) -> Concepts:
    """Read what `write_concepts` wrote.

    Raises
    ------
    InputError
        If the file is not there, is no file of concepts, or is one of another version.
    """
    if not Path(path).is_file():
        raise InputError(f"{path}: there is no such file; learn concepts first (vrdp-prob learn-concepts).")
    try:
        stored = torch.load(path, map_location="cpu", weights_only=True)
        kind, version = stored["format"], stored["version"]
    except Exception as error:  # torch raises many kinds for a broken file, and each means the same
        raise _unreadable(path) from error
    if kind != FORMAT:
        raise _unreadable(path)
    if version != FORMAT_VERSION:
        raise InputError(
            f"{path}: the concepts are of format version {version}, this program reads {FORMAT_VERSION}; "
            "learn them again (vrdp-prob learn-concepts)."
        )
    try:
        vocabulary = Vocabulary({name: tuple(words) for name, words in json.loads(stored["words"]).items()})
        networks = tuple(_network(vocabulary, state) for state in stored["networks"])
        if not networks:
            raise _unreadable(path)
        return Concepts(networks, Lessons(**json.loads(stored["lessons"])))
    except (KeyError, TypeError, ValueError, AttributeError, RuntimeError) as error:
        raise _unreadable(path) from error


def _network(vocabulary: Vocabulary, state: dict[str, torch.Tensor]) -> ConceptNetwork:
    network = ConceptNetwork(vocabulary)
    network.load_state_dict(state)
    if not all(torch.isfinite(value).all() for value in state.values()):
        raise ValueError("weights that are not finite")
    return network.eval()


def _unreadable(path: Path | str) -> InputError:
    return InputError(
        f"{path}: the file holds no learned concepts, or only part of them; give one that learn-concepts wrote."
    )
