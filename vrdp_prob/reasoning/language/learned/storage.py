"""The parser's weights as a file: plain arrays in half precision and the vocabulary, no code."""

import zipfile
from importlib.resources import files
from pathlib import Path

import numpy as np
import torch

from vrdp_prob.errors import InputError
from vrdp_prob.files import write_atomically
from vrdp_prob.reasoning.language.learned.network import ParserNetwork, Vocabulary

WEIGHTS = Path(str(files(__package__) / "weights.npz"))
"""The weights that ship with the package."""

_VOCABULARY = ("words", "tokens")
_WEIGHT = "weight/"


def write_parser(path: Path, network: ParserNetwork, vocabulary: Vocabulary) -> None:
    """Write weights and vocabulary.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    weights = {f"{_WEIGHT}{name}": tensor.numpy().astype(np.float16) for name, tensor in network.state_dict().items()}
    with write_atomically(path) as temporary:
        np.savez_compressed(temporary, words=np.array(vocabulary.words), tokens=np.array(vocabulary.tokens), **weights)


def read_parser(path: Path) -> tuple[ParserNetwork, Vocabulary]:
    """Read what `write_parser` wrote.

    Raises
    ------
    InputError
        If the file is not there, or is no file of weights for this network.
    """
    try:
        with np.load(path, allow_pickle=False) as stored:
            words, tokens = (tuple(str(entry) for entry in stored[name]) for name in _VOCABULARY)
            weights = {
                name.removeprefix(_WEIGHT): torch.from_numpy(stored[name].astype(np.float32))
                for name in stored.files
                if name not in _VOCABULARY
            }
        network = ParserNetwork(len(words), len(tokens))
        network.load_state_dict(weights)
    except (OSError, ValueError, KeyError, RuntimeError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(
            f"{path}: the weights of the learned parser cannot be read; install the package again or train them "
            "(python -m vrdp_prob.reasoning.language.learned.train)."
        ) from error
    return network.eval(), Vocabulary(words, tokens)
