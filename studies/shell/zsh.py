"""The script that zsh completes with: functions with a case per command and per option.

>>> print(zsh_script(words_of_all()))                              # doctest: +SKIP
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence

from studies.shell.words import Flag, Words

HEAD = """\
#compdef flexsim
# zsh: completion of flexsim, as `flexsim completion zsh` prints it
"""
TAIL = r"""
_flexsim_offer() {  # values, ending of files
    (($#values)) && compadd -a values
    case $ending in
    -) ;;
    /) _files -/ ;;
    *) _files -g "*$ending" ;;
    esac
}

_flexsim() {
    local word active='' current=$words[CURRENT] ending=-
    local -i count=0 place=0 most=0
    local -a values flags typed commands
    typed=("${(@)words[2,CURRENT-1]}")
    _flexsim_commands
    if ((CURRENT == 2)) || [[ "$typed" == help ]]; then
        _describe command commands
        return
    fi
    for word in "${(@)typed[2,-1]}"; do
        if [[ $word == --*=* ]]; then
            active='' most=0
        elif [[ $word == --* ]]; then
            active=$word count=0
            _flexsim_flag $typed[1]/$active
        elif ((count < most)); then
            ((count++))
        else
            ((place++))
        fi
    done
    _flexsim_command $typed[1]
    if [[ $current == --*=* ]]; then
        _flexsim_flag "$typed[1]/${current%%=*}"
        compset -P '*='
        _flexsim_offer
    elif [[ $current == -* ]]; then
        _describe -o option flags
    elif ((count < most)); then
        _flexsim_offer
    else
        _flexsim_flag $typed[1]/$place
        if ((most)); then _flexsim_offer; else _describe -o option flags; fi
    fi
}

if [[ $funcstack[1] == _flexsim ]]; then _flexsim "$@"; else compdef _flexsim flexsim; fi
"""


def zsh_script(words: Sequence[Words]) -> str:
    """Return the script, for a folder of `fpath` or to be sourced."""
    lines = [HEAD, "_flexsim_commands() {", "    commands=("]
    lines += [f"        {_described(each.command, each.about)}" for each in words]
    lines += ["    )", "}", "", "_flexsim_command() {  # its options", "    case $1 in"]
    for each in words:
        flags = " ".join(_described(name, flag.about) for flag in each.flags for name in flag.names)
        lines.append(f"    {each.command}) flags=({flags}) ;;")
    lines += ["    esac", "}", ""]
    lines += ["_flexsim_flag() {  # command/option or command/place: its values", "    case $1 in"]
    lines += [line for each in words for line in _cases(each)]
    lines += ["    *) most=0 values=() ending=- ;;", "    esac", "}"]
    return "\n".join(lines) + TAIL


def _described(name: str, about: str) -> str:
    """Return a word of `_describe`: the name, a colon, and what it is."""
    return shlex.quote(f"{name}:{about}".rstrip(":"))


def _cases(words: Words) -> Iterator[str]:
    """Give a case for every option that takes a value, and for every place."""
    for flag in words.flags:
        if flag.most:
            yield _case([f"{words.command}/{name}" for name in flag.names], flag)
    for place, flag in enumerate(words.places):
        yield _case([f"{words.command}/{place}"], flag)


def _case(patterns: Sequence[str], flag: Flag) -> str:
    ending = "-" if flag.ending is None else flag.ending
    values = " ".join(map(shlex.quote, flag.values))
    sets = f"most={flag.most} values=({values}) ending={shlex.quote(ending)}"
    return f"    {'|'.join(patterns)}) {sets} ;;"
