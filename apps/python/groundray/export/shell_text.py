"""Texts about a command, from its parser: completion scripts for shells, and a manual page."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

_BASH = """\
# bash completion of {program}, printed by `{program} --completion bash`
{function}() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD - 1]}}
  local words='' files=''
  if [[ $current == '=' ]]; then
    current=''
  elif [[ $previous == '=' ]]; then
    previous=${{COMP_WORDS[COMP_CWORD - 2]}}
  fi
  COMPREPLY=()
  case $previous in
{values}    *) if [[ $current == -* ]]; then words='{options}'; else files=1; fi ;;
  esac
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
  if [[ -n $files ]]; then
    compopt -o filenames 2>/dev/null
    mapfile -t -O "${{#COMPREPLY[@]}}" COMPREPLY < <(compgen -f -- "$current")
  fi
}}
complete -F {function} {program}
"""


def _has_value(action: argparse.Action) -> bool:
    return action.nargs != 0


def _label(action: argparse.Action) -> str:
    if not _has_value(action):
        return ""
    if action.choices:
        return "|".join(map(str, action.choices))
    return str(action.metavar or action.dest.upper())


def _options(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    return [action for action in parser._actions if action.option_strings]


def _arguments(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    return [action for action in parser._actions if not action.option_strings]


def _function(parser: argparse.ArgumentParser) -> str:
    return "_" + parser.prog.replace("-", "_")


def bash_completion(parser: argparse.ArgumentParser) -> str:
    """Returns a script that completes command lines in bash."""
    values = ""
    for action in _options(parser):
        if not _has_value(action):
            continue
        value = "files=1" if action.type is Path else "words=''"
        if action.choices:
            value = f"words='{' '.join(map(str, action.choices))}'"
        values += f"    {'|'.join(action.option_strings)}) {value} ;;\n"
    names = [name for action in _options(parser) for name in action.option_strings]
    return _BASH.format(
        program=parser.prog, function=_function(parser), values=values, options=" ".join(names)
    )


def _zsh_text(text: str) -> str:
    for mark in "\\[]:":
        text = text.replace(mark, "\\" + mark)
    return text.replace("'", "'\\''")


def _zsh_action(action: argparse.Action) -> str:
    if action.choices:
        return f"({' '.join(map(str, action.choices))})"
    return "_files" if action.type is Path else " "


def zsh_completion(parser: argparse.ArgumentParser) -> str:
    """Returns a script that completes command lines in zsh, for a folder of its `fpath`."""
    lines = []
    for action in _options(parser):
        others = "*" if isinstance(action, argparse._AppendAction) else ""
        others = others or f"({' '.join(action.option_strings)})"
        value = f":{_zsh_text(_label(action))}:{_zsh_action(action)}" if _has_value(action) else ""
        text = _zsh_text(action.help or "")
        lines += [f"'{others}{name}[{text}]{value}'" for name in action.option_strings]
    lines += [f"':{_label(action)}:{_zsh_action(action)}'" for action in _arguments(parser)]
    body = " \\\n    ".join(["_arguments -s -S", *lines])
    head = f"#compdef {parser.prog}\n# zsh completion, printed by `{parser.prog} --completion zsh`"
    return f'{head}\n{_function(parser)}() {{\n  {body}\n}}\n{_function(parser)} "$@"\n'


def _roff(text: str) -> str:
    safe = text.replace("\\", "\\e").replace("-", "\\-")
    return "\\&" + safe if safe.startswith((".", "'")) else safe


def _roff_entry(action: argparse.Action) -> str:
    names = ", ".join(f"\\fB{_roff(name)}\\fR" for name in action.option_strings)
    label = f"\\fI{_roff(_label(action))}\\fR" if _label(action) else ""
    heading = " ".join(filter(None, (names, label)))
    required = " (required)" if action.required else ""
    return f".TP\n{heading}\n{_roff(action.help or '')}{required}\n"


def man_page(parser: argparse.ArgumentParser) -> str:
    """Returns the manual page, for `man`. It has no date: equal programs give equal bytes."""
    description = _roff(parser.description or "")
    needed = [
        f"\\fB{_roff(action.option_strings[-1])}\\fR \\fI{_roff(_label(action))}\\fR"
        for action in _options(parser)
        if action.required
    ]
    needed += [f"\\fI{_roff(_label(action))}\\fR" for action in _arguments(parser)]
    entries = "".join(map(_roff_entry, [*_arguments(parser), *_options(parser)]))
    others = "groundray", "groundray-golden", "groundray-view"
    see = " ,\n".join(f".BR {_roff(name)} (1)" for name in others)
    summary = description[:1].lower() + description[1:].rstrip(".")
    return (
        f'.TH {_roff(parser.prog.upper())} 1 "" "groundray" "User commands"\n'
        f".SH NAME\n{_roff(parser.prog)} \\- {summary}\n"
        f".SH SYNOPSIS\n.B {_roff(parser.prog)}\n" + "\n".join(needed) + "\n[\\fIoptions\\fR]\n"
        f".SH DESCRIPTION\n{description}\n.SH OPTIONS\n{entries}"
        f".SH NOTES\n{_roff(parser.epilog or '')}\n.SH SEE ALSO\n{see}\n"
    )


class PrintText(argparse.Action):
    """Option that prints a text about the command, and ends it."""

    def __init__(
        self,
        option_strings: Sequence[str],
        dest: str,
        texts: dict[str, Callable[[argparse.ArgumentParser], str]],
        help: str | None = None,
        metavar: str | None = None,
        default: str = argparse.SUPPRESS,
    ) -> None:
        choices = None if len(texts) == 1 else tuple(texts)
        nargs = 0 if choices is None else None
        super().__init__(
            option_strings,
            dest,
            nargs=nargs,
            choices=choices,
            help=help,
            metavar=metavar,
            default=default,
        )
        self._texts = texts

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[Any] | None,
        option_string: str | None = None,
    ) -> None:
        """Prints the text that the value names, or the only one."""
        text = self._texts[values] if isinstance(values, str) else next(iter(self._texts.values()))
        sys.stdout.write(text(parser))
        parser.exit()


def add_text_options(parser: argparse.ArgumentParser) -> None:
    """Adds --completion and --man to a command."""
    parser.add_argument(
        "--completion",
        action=PrintText,
        texts={"bash": bash_completion, "zsh": zsh_completion},
        default=argparse.SUPPRESS,
        help="print a script that completes command lines in this shell",
    )
    parser.add_argument(
        "--man",
        action=PrintText,
        texts={"man": man_page},
        default=argparse.SUPPRESS,
        help="print the manual page, for man -l -",
    )
