"""Where a lesson is: the epoch that comes next, the best weights so far, and the file that keeps both."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from vrdp_prob.concepts.perceived.network import ConceptNetwork
from vrdp_prob.concepts.perceived.standing import Standing
from vrdp_prob.files import write_atomically

State = dict[str, Any]
KEPT = frozenset(("network", "optimiser", "best", "epoch", "best_epoch", "loss", "right"))


class TrainingState:
    """State of one lesson of a network; taken from its file where there is one.

    Parameters
    ----------
    network, optimiser
        What learns; both take the state of the file.
    file
        Keeps the state after each epoch; nothing does where None.
    """

    def __init__(self, network: ConceptNetwork, optimiser: torch.optim.Optimizer, file: Path | None) -> None:
        self._network, self._optimiser, self._file = network, optimiser, file
        self.epoch, self.best_epoch = 0, 0
        self.standing = Standing(math.inf, 0.0)
        self.best: Mapping[str, Tensor] = _copy(network.state_dict())
        kept = _read(file)
        if kept is not None:
            network.load_state_dict(kept["network"])
            optimiser.load_state_dict(kept["optimiser"])
            self.best, self.epoch, self.best_epoch = kept["best"], kept["epoch"], kept["best_epoch"]
            self.standing = Standing(kept["loss"], kept["right"])

    def finish_epoch(self, standing: Standing) -> None:
        """Note how well the network stands after an epoch, and keep its state."""
        if standing.loss < self.standing.loss:
            self.standing, self.best_epoch, self.best = standing, self.epoch, _copy(self._network.state_dict())
        self.epoch += 1
        if self._file is not None:
            with write_atomically(self._file) as temporary:
                torch.save(self._state(), temporary)

    def _state(self) -> State:
        return {
            "network": self._network.state_dict(),
            "optimiser": self._optimiser.state_dict(),
            "best": self.best,
            "epoch": self.epoch,
            "best_epoch": self.best_epoch,
            "loss": self.standing.loss,
            "right": self.standing.right,
        }


def _read(file: Path | None) -> State | None:
    """State that was kept; None where there is none or it cannot be read, and the lesson begins anew."""
    if file is None or not file.is_file():
        return None
    try:
        kept: State = torch.load(file, weights_only=True, map_location="cpu")
    except Exception:  # torch raises many kinds for a broken file, and each means the same
        return None
    return kept if isinstance(kept, dict) and kept.keys() == KEPT else None


def _copy(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    return {name: value.detach().clone() for name, value in state.items()}
