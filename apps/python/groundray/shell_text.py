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
  local command='' options='' words='' files=''
  if [[ $current == '=' ]]; then
    current=''
  elif [[ $previous == '=' ]]; then
    previous=${{COMP_WORDS[COMP_CWORD - 2]}}
  fi
{commands}  COMPREPLY=()
  case "$command $previous" in
{values}    *)
      case $command in
{options}      esac
      if [[ $current == -* ]]; then words=$options files=''; fi
      ;;
  esac
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
  if [[ -n $files ]]; then
    compopt -o filenames 2>/dev/null
    mapfile -t -O "${{#COMPREPLY[@]}}" COMPREPLY < <(compgen -f -- "$current")
  fi
}}
complete -F {function} {program}
"""
_BASH_COMMANDS = """\
  if ((COMP_CWORD > 1)); then
    case ${{COMP_WORDS[1]}} in
      {names}) command=${{COMP_WORDS[1]}} ;;
    esac
  fi
"""
_ZSH_COMMANDS = """\
  local context state line
  local -a commands=(
{texts}
  )
{arguments} \\
    '1:command:{{_describe command commands}}' \\
    '*::argument:->arguments'
  [[ $state == arguments ]] || return
  case $line[1] in
{calls}
  esac
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
    return [
        action
        for action in parser._actions
        if not action.option_strings and not isinstance(action, argparse._SubParsersAction)
    ]


def _commands(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """Returns the commands of a program by their names; none if it has none."""
    return next(
        (dict(a.choices) for a in parser._actions if isinstance(a, argparse._SubParsersAction)), {}
    )


def _function(parser: argparse.ArgumentParser) -> str:
    return "_" + parser.prog.replace("-", "_")


def bash_completion(parser: argparse.ArgumentParser) -> str:
    """Returns a script that completes command lines in bash."""
    commands = _commands(parser)
    values = options = ""
    for name, each in {"": parser, **commands}.items():
        for action in filter(_has_value, _options(each)):
            value = "files=1" if action.type is Path else "words=''"
            if action.choices:
                value = f"words='{' '.join(map(str, action.choices))}'"
            places = "|".join(f"'{name} {option}'" for option in action.option_strings)
            values += f"    {places}) {value} ;;\n"
        names = [option for action in _options(each) for option in action.option_strings]
        first = "files=1" if any(action.type is Path for action in _arguments(each)) else "words=''"
        if commands and not name:
            first = f"words='{' '.join(commands)}'"
        options += f"        '{name}') options='{' '.join(names)}' {first} ;;\n"
    return _BASH.format(
        program=parser.prog,
        function=_function(parser),
        commands=_BASH_COMMANDS.format(names="|".join(commands)) if commands else "",
        values=values,
        options=options,
    )


def _zsh_text(text: str) -> str:
    for mark in "\\[]:":
        text = text.replace(mark, "\\" + mark)
    return text.replace("'", "'\\''")


def _zsh_action(action: argparse.Action) -> str:
    if action.choices:
        return f"({' '.join(map(str, action.choices))})"
    return "_files" if action.type is Path else " "


def _zsh_arguments(parser: argparse.ArgumentParser, how: str) -> str:
    lines = []
    for action in _options(parser):
        others = "*" if isinstance(action, argparse._AppendAction) else ""
        others = others or f"({' '.join(action.option_strings)})"
        value = f":{_zsh_text(_label(action))}:{_zsh_action(action)}" if _has_value(action) else ""
        text = _zsh_text(action.help or "")
        lines += [f"'{others}{name}[{text}]{value}'" for name in action.option_strings]
    for action in _arguments(parser):
        any_number = "*" if action.nargs in ("*", "+") else ""
        lines.append(f"'{any_number}:{_label(action)}:{_zsh_action(action)}'")
    return " \\\n    ".join([f"  _arguments {how}", *lines])


def zsh_completion(parser: argparse.ArgumentParser) -> str:
    """Returns a script that completes command lines in zsh, for a folder of its `fpath`."""
    function, commands = _function(parser), _commands(parser)
    text = (
        f"#compdef {parser.prog}\n# zsh completion, printed by `{parser.prog} --completion zsh`\n"
    )
    body = _zsh_arguments(parser, "-C" if commands else "-s -S") + "\n"
    if commands:
        told = {name: _zsh_text(each.description or "") for name, each in commands.items()}
        body = _ZSH_COMMANDS.format(
            texts="\n".join(f"    '{name}:{text}'" for name, text in told.items()),
            arguments=body.rstrip(),
            calls="\n".join(f"    {name}) {function}_{name} ;;" for name in commands),
        )
    text += f"{function}() {{\n{body}}}\n"
    for name, each in commands.items():
        text += f"{function}_{name}() {{\n{_zsh_arguments(each, '-s -S')}\n}}\n"
    return f'{text}{function} "$@"\n'


def _roff(text: str) -> str:
    safe = text.replace("\\", "\\e").replace("-", "\\-")
    return "\\&" + safe if safe.startswith((".", "'")) else safe


def _roff_entry(action: argparse.Action) -> str:
    names = ", ".join(f"\\fB{_roff(name)}\\fR" for name in action.option_strings)
    label = f"\\fI{_roff(_label(action))}\\fR" if _label(action) else ""
    heading = " ".join(filter(None, (names, label)))
    required = " (required)" if action.required else ""
    return f".TP\n{heading}\n{_roff(action.help or '')}{required}\n"


def _roff_entries(parser: argparse.ArgumentParser) -> str:
    return "".join(map(_roff_entry, [*_arguments(parser), *_options(parser)]))


def _roff_synopsis(parser: argparse.ArgumentParser) -> str:
    lines = [f".B {_roff(parser.prog)}"]
    lines += [
        f"\\fB{_roff(action.option_strings[-1])}\\fR \\fI{_roff(_label(action))}\\fR"
        for action in _options(parser)
        if action.required
    ]
    lines += [f"\\fI{_roff(_label(action))}\\fR" for action in _arguments(parser)]
    lines += ["[\\fIoptions\\fR]", *(["\\fIcommand\\fR"] if _commands(parser) else [])]
    return "\n".join(lines) + "\n"


def man_page(parser: argparse.ArgumentParser) -> str:
    """Returns the manual page, for `man`. It has no date: equal programs give equal bytes."""
    description = _roff(parser.description or "")
    commands = "".join(
        f".SS {_roff(name)}\n{_roff(each.description or '')}\n.PP\n"
        f"{_roff_synopsis(each)}{_roff_entries(each)}"
        for name, each in _commands(parser).items()
    )
    others = "groundray", "groundray-golden", "groundray-view"
    see = " ,\n".join(f".BR {_roff(name)} (1)" for name in others)
    summary = description[:1].lower() + description[1:].rstrip(".")
    return (
        f'.TH {_roff(parser.prog.upper())} 1 "" "groundray" "User commands"\n'
        f".SH NAME\n{_roff(parser.prog)} \\- {summary}\n"
        f".SH SYNOPSIS\n{_roff_synopsis(parser)}"
        f".SH DESCRIPTION\n{description}\n.SH OPTIONS\n{_roff_entries(parser)}"
        + (f".SH COMMANDS\n{commands}" if commands else "")
        + f".SH NOTES\n{_roff(parser.epilog or '')}\n.SH SEE ALSO\n{see}\n"
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
