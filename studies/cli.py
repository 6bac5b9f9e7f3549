"""The command line: what may be typed, and which verb's module answers it.

Nothing heavy is imported before a verb has been chosen, so that ``--help`` and a
mistyped command answer at once.
"""

import argparse
import io
import os
import signal
import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

from .. import __version__

VERBS = {
    "feeder": {
        "check": "every fault of a feeder file at once, or a summary of its sections",
        "import": "a feeder file from an OpenDSS file, with a fidelity report",
        "solve": "one open phase: phasors before and after, and what each terminal says",
    },
    "study": {
        "size": "the best settings of every section, with their certificate",
        "assess": "the same evidence for settings that exist already; nothing is chosen",
        "compare": "runs that share their draws, scenario by scenario: what was gained, and lost",
    },
    "proof": {
        "paper": "the paper's results beside what the model makes of its feeder, and why",
    },
}
"""Group, verb, and what the verb does in a line: ``--help`` is printed from here."""

FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130

_EXIT_CODES = """\
exit codes:
  0  answered
  1  could not be done
  2  the input is at fault
  3  answered, but some section has no settings that find anything, or no certificate"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    Parameters
    ----------
    argv
        The words after ``openphase``; those of this process by default.

    Raises
    ------
    SystemExit
        From argparse: 0 after ``--help`` and ``--version``, 2 for a wrong command line.
    """
    # The same bytes on any number of cores: how BLAS cuts a sum depends on its threads.
    for library in ("OMP", "OPENBLAS", "MKL"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    _speak_utf8()
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, _interrupt)
    try:
        code = _answer(build_parser().parse_args(argv))
        if sys.stdout:
            sys.stdout.flush()
        return code
    except OSError as error:
        if error.filename is not None:
            print(f"{error.filename}: {error.strerror or error}", file=sys.stderr)
            return FAILED
        # The reader (head, less) has left, or the answer has no room where it should go:
        # keep the interpreter from complaining again as it ends.
        if not isinstance(error, BrokenPipeError):
            print(f"the answer cannot be written: {error.strerror or error}", file=sys.stderr)
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED


def _interrupt(*_: object) -> None:
    """End on a polite kill as on Ctrl-C: workers are stopped, the run resumes."""
    raise KeyboardInterrupt


def _speak_utf8() -> None:
    """Answers and messages are UTF-8, whatever the locale says: they hold Δ, Ω and → ."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(encoding="utf-8")


def _answer(args: argparse.Namespace) -> int:
    """Hand the command to its verb, and turn what it raises into a message and a code."""
    try:
        from ..model.errors import InputError, OpenPhaseError

        handler: Callable[[argparse.Namespace], int] = args.handler
        try:
            return handler(args)
        except InputError as error:
            print(error, file=sys.stderr)
            return BAD_INPUT
        except OpenPhaseError as error:
            print(error, file=sys.stderr)
            return FAILED
    except KeyboardInterrupt:
        resumes = "; the same command resumes" if args.resumes else ""
        print(f"interrupted{resumes}", file=sys.stderr)
        return INTERRUPTED


def build_parser() -> argparse.ArgumentParser:
    """Build the parser of the whole command line."""
    parser = argparse.ArgumentParser(
        prog="openphase",
        usage="openphase VERB ...   (openphase VERB --help explains one verb)",
        description="Size, prove and place open-phase detection on distribution feeders.",
        epilog=f"{_verb_table()}\n\n{_EXIT_CODES}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"openphase {__version__}")
    verbs = parser.add_subparsers(
        dest="verb", metavar="VERB", required=True, prog="openphase", help=argparse.SUPPRESS
    )
    arguments = {
        "check": _check_arguments,
        "import": _import_arguments,
        "solve": _solve_arguments,
        "size": _size_arguments,
        "assess": _assess_arguments,
        "compare": _compare_arguments,
        "paper": _paper_arguments,
    }
    for group in VERBS.values():
        for verb, summary in group.items():
            verb_parser = verbs.add_parser(verb, description=summary, allow_abbrev=False)
            verb_parser.set_defaults(resumes=False)
            arguments[verb](verb_parser)
    return parser


def _verb_table() -> str:
    rows = []
    for group, verbs in VERBS.items():
        rows.append(f"{group}:")
        rows += [f"  {verb:<10} {summary}" for verb, summary in verbs.items()]
    return "\n".join(rows)


def _check_arguments(parser: argparse.ArgumentParser) -> None:
    _add_feeder(parser)
    parser.add_argument(
        "--plot",
        type=Path,
        nargs="?",
        const=Path(),
        metavar="FILE",
        help="draw the feeder into FILE (default: FEEDER's name with .png, in this folder)",
    )
    _add_json(parser)
    parser.set_defaults(handler=_check)


def _import_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", type=Path, metavar="FILE", help="the .dss file of the circuit")
    parser.add_argument(
        "-o", dest="output", type=Path, metavar="feeder.toml", help="the feeder file to write"
    )
    csvs = {
        "transformers": "connection by unit: unit,connection (unknown is one)",
        "points": "existing reclosers: name,bus[,line]",
        "peaks": "measured maxima and minima, or hourly amperes, at points",
    }
    for name, text in csvs.items():
        parser.add_argument(f"--{name}", type=Path, metavar="CSV", help=text)
    parser.add_argument(
        "--drop",
        action="append",
        default=[],
        metavar="ELEMENT",
        help="leave an element out, as class.name (may be given several times)",
    )
    parser.add_argument(
        "--solve-controls",
        action="store_true",
        help="taps and capacitor steps where OpenDSS's controls settle (default: the file's)",
    )
    parser.add_argument(
        "--reduce",
        action="store_true",
        help="fold laterals and low-voltage networks; the error is measured and printed",
    )
    parser.add_argument(
        "--report", type=Path, metavar="FILE", help="also write the report, .md or .json"
    )
    _add_json(parser)
    parser.set_defaults(handler=_import)


def _solve_arguments(parser: argparse.ArgumentParser) -> None:
    _add_feeder(parser)
    parser.add_argument(
        "--open",
        required=True,
        metavar="LINE:FRACTION:PHASES",
        help="what breaks, the fraction counted from the line's from-end: R2-R3:0.6:a",
    )
    parser.add_argument(
        "--close",
        action="append",
        default=[],
        metavar="SWITCH",
        help="close a switch first (may be given several times)",
    )
    parser.add_argument(
        "--settings",
        type=Path,
        metavar="SHEET.csv",
        help="settings of the terminals (default: 1 A, 5 %%, 5 Ω, sign on)",
    )
    _add_json(parser)
    parser.set_defaults(handler=_solve)


def _size_arguments(parser: argparse.ArgumentParser) -> None:
    _add_feeder(parser)
    _add_run(parser, "runs/<feeder>")
    parser.set_defaults(handler=_size, resumes=True)


def _assess_arguments(parser: argparse.ArgumentParser) -> None:
    _add_feeder(parser)
    parser.add_argument(
        "--settings",
        required=True,
        metavar="SHEET.csv",
        help="the settings to judge, as size writes them; or the word reference: the study's "
        "[reference] at every terminal",
    )
    _add_run(parser, "runs/<feeder>-<sheet>")
    parser.set_defaults(handler=_assess, resumes=True)


def _compare_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "runs",
        nargs="+",
        type=Path,
        metavar="RUN",
        help="folders that size or assess left; each further one is compared with the first",
    )
    _add_json(parser)
    parser.set_defaults(handler=_compare)


def _add_run(parser: argparse.ArgumentParser, out: str) -> None:
    """What every verb that draws scenarios takes."""
    parser.add_argument(
        "--study",
        type=Path,
        metavar="FILE",
        help="what may happen on the feeder (default: the feeder's own study, if it ships)",
    )
    parser.add_argument(
        "--scenarios",
        type=_count_from(1),
        metavar="N",
        help="validation scenarios per class of events (default: what the target needs)",
    )
    parser.add_argument("--seed", type=_count_from(0), metavar="S", help="seed (default: 1)")
    parser.add_argument(
        "--jobs",
        type=_count_from(1),
        default=2,
        metavar="J",
        help="processes at work; never changes a number (default: %(default)s)",
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help=f"the run folder (default: {out})")
    parser.add_argument(
        "--yes", action="store_true", help="do not stop at a study of more than ten minutes"
    )
    _add_json(parser)


def _paper_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="also leave the answer and the pictures in DIR"
    )
    _add_json(parser)
    parser.set_defaults(handler=_paper)


def _add_feeder(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "feeder",
        metavar="FEEDER",
        help="a feeder file, a shipped name such as paper, or an OpenDSS file",
    )


def _add_json(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="answer with one JSON object")


def _count_from(least: int) -> Callable[[str], int]:
    """Return a parser of whole numbers that are at least ``least``."""

    def parse(text: str) -> int:
        if text.isdecimal() and int(text) >= least:
            return int(text)
        raise argparse.ArgumentTypeError(f"must be a whole number >= {least}, got {text!r}")

    return parse


def _check(args: argparse.Namespace) -> int:
    from .checking import check_command

    return check_command(args)


def _import(args: argparse.Namespace) -> int:
    from .importing import import_command

    return import_command(args)


def _solve(args: argparse.Namespace) -> int:
    from .solving import solve_command

    return solve_command(args)


def _size(args: argparse.Namespace) -> int:
    from .sizing import size_command

    return size_command(args)


def _assess(args: argparse.Namespace) -> int:
    from .assessing import assess_command

    return assess_command(args)


def _compare(args: argparse.Namespace) -> int:
    from .comparing import compare_command

    return compare_command(args)


def _paper(args: argparse.Namespace) -> int:
    from .paper.command import paper_command

    return paper_command(args)
