"""Completion script for fish, which keeps commas in values and in their descriptions.

Click's own splits lines at every comma: ``--features line,o`` would offer nothing.
"""

from __future__ import annotations

from click.shell_completion import CompletionItem, FishComplete, add_completion_class

_SCRIPT = """\
function %(complete_func)s
    set -lx %(complete_var)s fish_complete
    set -lx COMP_WORDS (commandline -cp)
    set -lx COMP_CWORD (commandline -t)
    for line in (command %(prog_name)s)
        set -l parts (string split -m 1 ',' -- $line)
        switch $parts[1]
            case dir
                __fish_complete_directories $parts[2]
            case file
                __fish_complete_path $parts[2]
            case '*'
                echo $parts[2]
        end
    end
end
complete --no-files --command %(prog_name)s --arguments '(%(complete_func)s)'
"""


class CommaFishComplete(FishComplete):
    """Completion for fish whose values may have commas."""

    source_template = _SCRIPT

    def format_completion(self, item: CompletionItem) -> str:
        """Return one line: type, value and description."""
        description = " ".join((item.help or "").split())
        return f"{item.type},{item.value}" + (f"\t{description}" if description else "")


def register() -> None:
    """Make click use this class for fish."""
    add_completion_class(CommaFishComplete, "fish")
