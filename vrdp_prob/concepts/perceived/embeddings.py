"""A space in which concepts lie as vectors: an object or a pair is what it is near to.

The score of a concept is (cos(P F, e) - mu) / sigma with a linear projection P of the feature F and the concept's
embedding e (Ding et al., NeurIPS 2021, section 3.2, after Mao et al., NS-CL, ICLR 2019).
"""

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional

DIMENSION = 64
"""Length C of an embedding."""

_FIRST_SIGMA = 0.2


class ConceptSpace(nn.Module):
    """Embeddings of some concepts, and the projection of features into their space.

    Parameters
    ----------
    concepts
        The words.
    features
        Length of a feature.
    mu
        Where the learned mu begins.
    """

    def __init__(self, concepts: tuple[str, ...], features: int, *, mu: float = 0.0) -> None:
        super().__init__()
        self.concepts = concepts
        self.projection = nn.Linear(features, DIMENSION)
        self.embeddings = nn.Parameter(functional.normalize(torch.randn(len(concepts), DIMENSION), dim=1))
        self.mu = nn.Parameter(torch.tensor(mu))
        self.log_sigma = nn.Parameter(torch.tensor(_FIRST_SIGMA).log())

    def scores(self, features: Float[Tensor, "*rest feature"]) -> Float[Tensor, "*rest concept"]:
        """Score of each concept."""
        cosine = (
            functional.normalize(self.projection(features), dim=-1) @ functional.normalize(self.embeddings, dim=-1).T
        )
        return (cosine - self.mu) / self.log_sigma.exp()

    def independent(self, features: Float[Tensor, "*rest feature"]) -> Float[Tensor, "*rest concept"]:
        """Probability of each concept, whatever the others are."""
        return torch.sigmoid(self.scores(features)).double()

    def exclusive(self, features: Float[Tensor, "*rest feature"]) -> Float[Tensor, "*rest concept"]:
        """Probability of each concept where exactly one holds, as of colours; the nearest one is likeliest."""
        return torch.softmax(self.scores(features), dim=-1).double()
