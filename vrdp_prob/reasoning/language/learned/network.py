"""The network: a bidirectional LSTM reads the words, an LSTM with attention writes the program.

As in NS-DR (Yi et al., CLEVRER, ICLR 2020) and VRDP (Ding et al., NeurIPS 2021), with attention after Luong et al.
(EMNLP 2015): the attended words join the state of the decoder before the output, not its next input.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor, nn

PADDING, BEGIN, END, NOTHING = "<PAD>", "<BEGIN>", "<END>", "<NOTHING>"
"""Tokens beside those of programs: the filling behind short texts, both ends, and the program of nonsense."""

KINDS = ("<question>", "<choice>")
"""First words of a text, which say what it is."""


@dataclass(frozen=True)
class Vocabulary:
    """Words that the network reads and tokens that it writes, in the order of their numbers.

    Parameters
    ----------
    words
        Padding, the kinds of text, then words.
    tokens
        Padding, both ends, the program of nonsense, then tokens.
    """

    words: tuple[str, ...]
    tokens: tuple[str, ...]

    @cached_property
    def word_numbers(self) -> Mapping[str, int]:
        """Number of each word."""
        return {word: number for number, word in enumerate(self.words)}


def numbers_of_text(kind: str, words: Sequence[str], vocabulary: Vocabulary) -> list[int]:
    """A text as the network reads it: its kind, then its words, all of which the vocabulary must have."""
    return [vocabulary.word_numbers[word] for word in (f"<{kind}>", *words)]


class ParserNetwork(nn.Module):
    """Probabilities of the next token of a program, given the words and the tokens before it.

    Parameters
    ----------
    words, tokens
        Sizes of the vocabularies.
    embedding, hidden
        Length of the vectors of words and tokens, and of the encoder's state in each direction.
    dropout
        Share of the vectors' entries that training hides.
    """

    def __init__(self, words: int, tokens: int, *, embedding: int = 48, hidden: int = 64, dropout: float = 0.1) -> None:
        super().__init__()
        state = 2 * hidden
        self.words = nn.Embedding(words, embedding, padding_idx=0)
        self.tokens = nn.Embedding(tokens, embedding, padding_idx=0)
        self.encoder = nn.LSTM(embedding, hidden, batch_first=True, bidirectional=True)
        self.decoder = nn.LSTM(embedding, state, batch_first=True)
        self.score = nn.Linear(state, state, bias=False)
        self.join = nn.Linear(2 * state, state)
        self.output = nn.Linear(state, tokens)
        self.dropout = nn.Dropout(dropout)

    def read(
        self, text: Int[Tensor, "text word"]
    ) -> tuple[Float[Tensor, "text word state"], Bool[Tensor, "text word"], tuple[Tensor, Tensor]]:
        """Vectors of the words, which of them are words, and the first state of the decoder."""
        there = text != 0
        packed = nn.utils.rnn.pack_padded_sequence(
            self.dropout(self.words(text)), there.sum(dim=1).cpu(), batch_first=True, enforce_sorted=False
        )
        states, (last, cell) = self.encoder(packed)
        read, _ = nn.utils.rnn.pad_packed_sequence(states, batch_first=True, total_length=text.shape[1])
        return read, there, (_joined(last), _joined(cell))

    def write(
        self,
        before: Int[Tensor, "text token"],
        read: Float[Tensor, "text word state"],
        there: Bool[Tensor, "text word"],
        state: tuple[Tensor, Tensor],
    ) -> tuple[Float[Tensor, "text token vocabulary"], tuple[Tensor, Tensor]]:
        """Log probabilities of the token after each of the given ones, and the state of the decoder after the last."""
        written, state = self.decoder(self.dropout(self.tokens(before)), state)
        scores = (self.score(written) @ read.transpose(1, 2)).masked_fill(~there[:, None, :], -torch.inf)
        attended = torch.softmax(scores, dim=2) @ read
        joined = torch.tanh(self.join(torch.cat((attended, written), dim=2)))
        return torch.log_softmax(self.output(self.dropout(joined)), dim=2), state

    def forward(
        self, text: Int[Tensor, "text word"], before: Int[Tensor, "text token"]
    ) -> Float[Tensor, "text token vocabulary"]:
        """Log probabilities of the token after each of the given ones."""
        return self.write(before, *self.read(text))[0]


def _joined(states: Float[Tensor, "direction text hidden"]) -> Float[Tensor, "layer text state"]:
    """The states of both directions side by side, as one layer."""
    return torch.cat((states[0], states[1]), dim=1)[None]
