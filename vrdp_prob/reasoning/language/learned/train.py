"""Train the learned parser and measure it: `python -m vrdp_prob.reasoning.language.learned.train`.

Writes the weights that ship with the package and prints the table of docs/questions.md. With `--measure` the weights
stay as they are.
"""

import argparse
from dataclasses import asdict
from pathlib import Path

import torch

from vrdp_prob.errors import InputError
from vrdp_prob.progress import TerminalProgress
from vrdp_prob.reasoning.language.learned.measure import Score, scores
from vrdp_prob.reasoning.language.learned.parser import THRESHOLD, learned_parser
from vrdp_prob.reasoning.language.learned.storage import WEIGHTS, write_parser
from vrdp_prob.reasoning.language.learned.training import EXAMPLES, STEPS, train

COLUMNS = {
    "templates": "templates",
    "texts": "texts",
    "grammar_right": "grammar right",
    "grammar_wrong": "grammar wrong",
    "network_right": "network alone right",
    "network_wrong": "network alone wrong",
    "right": "learned right",
    "wrong": "learned wrong",
    "unknown": "unknown word",
    "together": "both right",
    "together_wrong": "both wrong",
}


def main() -> None:
    """Read the options, train, measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--measure", action="store_true", help="only measure the weights that there are")
    parser.add_argument("--out", type=Path, default=WEIGHTS, help="file of the weights")
    parser.add_argument("--seed", type=int, default=0, help="seed of examples and training")
    parser.add_argument("--pairs", type=int, default=EXAMPLES, help="number of generated pairs")
    parser.add_argument("--steps", type=int, default=STEPS, help="steps of the optimiser")
    parser.add_argument("--fillings", type=int, default=8, help="texts measured for each template")
    parser.add_argument("--threads", type=int, default=1, help="processor cores; the weights depend on it slightly")
    arguments = parser.parse_args()
    torch.set_num_threads(arguments.threads)
    try:
        if not arguments.measure:
            trained = train(
                seed=arguments.seed, pairs=arguments.pairs, steps=arguments.steps, progress=TerminalProgress()
            )
            write_parser(arguments.out, *trained)
        learned = learned_parser(arguments.out)
    except InputError as error:
        parser.exit(2, f"{error}\n")
    print(f"threshold {THRESHOLD}, {arguments.fillings} texts from each template, shares in %\n")
    print("|".join(("", " group ", *(f" {title} " for title in COLUMNS.values()), "")))
    print("|---" * (len(COLUMNS) + 1) + "|")
    for row in scores(learned, fillings=arguments.fillings):
        print(_line(row), flush=True)


def _line(row: Score) -> str:
    values = asdict(row)
    cells = [f"{100 * value:.1f}" if isinstance(value := values[name], float) else str(value) for name in COLUMNS]
    return "|".join(("", f" {row.group} ", *(f" {cell} " for cell in cells), ""))


if __name__ == "__main__":
    main()
