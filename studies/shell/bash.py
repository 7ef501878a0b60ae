"""The script that bash completes with: functions with a case per command and per option.

>>> print(bash_script(words_of_all()))                             # doctest: +SKIP
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence

from studies.shell.words import Flag, Words

HEAD = """\
# bash: completion of flexsim, as `flexsim completion bash` prints it
"""
TAIL = r"""
_flexsim_offer() {  # current word, values, ending of files: what begins like it
    local found
    while IFS= read -r found; do COMPREPLY+=("$found"); done < <(
        compgen -W "$2" -- "$1"
        case $3 in
        -) ;;
        /) compgen -d -- "$1" ;;
        *) compgen -d -- "$1"; compgen -f -X "!*$3" -- "$1" ;;
        esac
    )
    [[ $3 == - ]] || compopt -o filenames 2>/dev/null
}

_flexsim() {
    local current=${COMP_WORDS[COMP_CWORD]} i word active='' count=0 place=0
    local flags='' most=0 values='' ending=- typed=()
    COMPREPLY=()
    for ((i = 1; i < COMP_CWORD; i++)); do  # bash parts words at = and :
        case ${COMP_WORDS[i]} in
        =) ;;
        :) ((i++)) ;;
        *) typed+=("${COMP_WORDS[i]}") ;;
        esac
    done
    [[ $current == : || $i -gt $COMP_CWORD ]] && return
    [[ $current == = ]] && current=''
    if ((${#typed[@]} == 0)) || [[ ${typed[*]} == help ]]; then
        _flexsim_offer "$current" "$_flexsim_commands" -
        return
    fi
    for word in "${typed[@]:1}"; do
        if [[ $word == --* ]]; then
            active=$word count=0
            _flexsim_flag "${typed[0]}/$active"
        elif ((count < most)); then
            ((count++))
        else
            ((place++))
        fi
    done
    _flexsim_command "${typed[0]}"
    if [[ $current == -* ]]; then
        _flexsim_offer "$current" "$flags" -
    elif ((count < most)); then
        _flexsim_offer "$current" "$values" "$ending"
    else
        _flexsim_flag "${typed[0]}/$place"
        ((most)) || values=$flags
        _flexsim_offer "$current" "$values" "$ending"
    fi
}

complete -F _flexsim flexsim
"""


def bash_script(words: Sequence[Words]) -> str:
    """Return the script, for bash 3.2 and later."""
    names = " ".join(["help", *(each.command for each in words)])
    lines = [HEAD, f"_flexsim_commands={shlex.quote(names)}", ""]
    lines += ["_flexsim_command() {  # its options", "    case $1 in"]
    for each in words:
        flags = " ".join(name for flag in each.flags for name in flag.names)
        lines.append(f"    {each.command}) flags={shlex.quote(flags)} ;;")
    lines += ["    esac", "}", ""]
    lines += ["_flexsim_flag() {  # command/option or command/place: its values", "    case $1 in"]
    lines += [line for each in words for line in _cases(each)]
    lines += ["    *) most=0 values='' ending=- ;;", "    esac", "}"]
    return "\n".join(lines) + TAIL


def _cases(words: Words) -> Iterator[str]:
    """Give a case for every option that takes a value, and for every place."""
    for flag in words.flags:
        if flag.most:
            yield _case([f"{words.command}/{name}" for name in flag.names], flag)
    for place, flag in enumerate(words.places):
        yield _case([f"{words.command}/{place}"], flag)


def _case(patterns: Sequence[str], flag: Flag) -> str:
    ending = "-" if flag.ending is None else flag.ending
    values = shlex.quote(" ".join(flag.values))
    sets = f"most={flag.most} values={values} ending={shlex.quote(ending)}"
    return f"    {'|'.join(patterns)}) {sets} ;;"
