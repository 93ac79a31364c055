"""Pages of the documentation that hold measured tables, and what the scripts behind them have in common."""

import argparse
import json
import os
from collections.abc import Mapping
from pathlib import Path

from vrdp_prob.files import write_atomically

BEGIN, END = "<!-- measured: begin -->", "<!-- measured: end -->"


def table_row(*cells: str) -> str:
    """A row of a table."""
    return f"| {' | '.join(cells)} |"


def write_between(path: Path, text: str) -> None:
    """Replace what stands between the marks in a page."""
    before, rest = path.read_text(encoding="utf-8").split(BEGIN)
    path.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{rest.split(END)[1]}", encoding="utf-8")


def page_parser(description: str | None, results: Path, *, document: str = "results") -> argparse.ArgumentParser:
    """Options of a script whose tables stand in a page, and whose results are gone on with.

    Parameters
    ----------
    description
        What the script is for.
    results
        Folder of the results where none is given.
    document
        What `--json` writes.
    """
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help=f"file for the {document}")
    parser.add_argument("--docs", type=Path, help="folder of the documentation, whose page is written anew")
    parser.add_argument("--results", type=Path, default=results, help="folder of the results, which are gone on with")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    return parser


def publish(text: str, page: str, document: Mapping[str, object], options: argparse.Namespace) -> None:
    """Print tables, and write them into their page and a document to a file where `page_parser`'s options say so."""
    print(text)
    if options.json:
        with write_atomically(options.json) as temporary:
            temporary.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    if options.docs:
        write_between(options.docs / page, text)
