"""The group of commands, and the handling of errors: one line and exit code 2, without a traceback."""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Sequence
from contextlib import suppress

import click

from eft._display import current_units, use_units
from eft._extras import missing
from eft._memory import MemoryUseWarning
from eft._native import __version__
from eft.cli._benchmark import benchmark
from eft.cli._check import check
from eft.cli._compare import compare
from eft.cli._demo import demo
from eft.cli._design import design
from eft.cli._export import export
from eft.cli._identify import identify
from eft.cli._init import init
from eft.cli._iterate import iterate
from eft.cli._map import stability_map
from eft.cli._report import report
from eft.cli._run import run
from eft.cli._serve import serve_rig
from eft.cli._study import study

BAD_INPUT = 2
INTERRUPTED = 130
CUT_OFF = 141
"""Exit code if the reader of the output closed it, as of a command that SIGPIPE ends."""
_LONGEST = 1000
"""Largest number of characters of a message, because it may contain a value from a file."""


_HELP = """Effective force testing: controller, virtual rig and analysis.

\b
A first test:
  eft init test.toml --test     a rig and a command, every key explained
  eft check test.toml           whether the rig can do it
  eft run test.toml             the test on the virtual rig, saved as test.eft
  eft report test.eft           the report, as test.html

Exit codes: 0 done, 1 done but the answer is no, 2 wrong input (nothing written), 130 interrupted.
"""


@click.group(help=_HELP, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="eft", message="%(prog)s %(version)s")
def cli() -> None:
    """All commands."""


for command in (
    init,
    check,
    identify,
    stability_map,
    run,
    iterate,
    study,
    report,
    compare,
    design,
    benchmark,
    export,
    serve_rig,
    demo,
):
    cli.add_command(command)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line ``eft``.

    Parameters
    ----------
    arguments : sequence of str, optional
        The words after ``eft``; by default those of the process.

    Returns
    -------
    int
        The exit code.

    Raises
    ------
    Exception
        If the package has an error; wrong input is a message and an exit code.

    Examples
    --------
    >>> from eft.cli import main
    >>> main(["--version"])
    eft 0.1.0
    0
    """
    names = list(sys.argv[1:] if arguments is None else arguments)
    # The group only; a command is named by its context.
    where = f"eft {names[0]}" if names and names[0] in cli.commands else "eft"
    try:
        # The choice of --units ends with the command.
        with use_units(current_units()), warnings.catch_warnings():
            # Each command has asked for --memory.
            warnings.simplefilter("ignore", MemoryUseWarning)
            # The name of a file may have letters that the font of a figure lacks.
            warnings.filterwarnings("ignore", "Glyph .* missing from font")
            return int(cli.main(args=names, prog_name="eft", standalone_mode=False) or 0)
    except click.exceptions.NoArgsIsHelpError as error:
        return _tell(error.format_message(), BAD_INPUT)
    except click.ClickException as error:
        return _say(where, error.format_message())
    except (click.Abort, KeyboardInterrupt):
        return _tell(f"{where}: interrupted", INTERRUPTED)
    except SystemExit as error:
        # Click exits by itself only for the completion of words, with 0, and if the reader closed the output.
        if error.code:
            return CUT_OFF
        raise
    except OSError as error:
        named = f"{error.filename}: {error.strerror}" if error.filename else str(error)
        return _say(where, re.sub(r" \(os error \d+\)$", "", named))
    except ModuleNotFoundError as error:
        package = (error.name or str(error)).partition(".")[0]
        return _say(where, missing(package, names))
    except (ValueError, OverflowError, MemoryError) as error:
        return _say(where, str(error) or "not enough memory")


def _say(where: str, message: str) -> int:
    sentence = " ".join(message.split())
    if len(sentence) > _LONGEST:
        sentence = sentence[:_LONGEST] + "…"
    return _tell(f"{where}: {sentence}", BAD_INPUT)


def _tell(text: str, code: int) -> int:
    # On a full disk only the exit code is left.
    with suppress(OSError):
        click.echo(text, err=True)
    return code
