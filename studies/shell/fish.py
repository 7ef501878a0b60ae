"""The script that fish completes with: a line per command, per option and per place.

>>> print(fish_script(words_of_all()))                             # doctest: +SKIP
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from studies.shell.words import Flag, Words

HEAD = r"""# fish: completion of flexsim, as `flexsim completion fish` prints it

function __flexsim_first  # no command is typed yet, or help alone
    set -l typed (commandline -opc)
    test (count $typed) -eq 1; or test "$typed[2..-1]" = help
end

function __flexsim_is  # the command is this one
    set -l typed (commandline -opc)
    test (count $typed) -ge 2; and test "$typed[2]" = $argv[1]
end

function __flexsim_more  # of this command, an option takes at most so many values: more fit
    __flexsim_is $argv[1]; or return 1
    set -l count 0
    for word in (commandline -opc)[-1..3]
        if string match -q -- '--*' $word
            contains -- $word $argv[3..-1]; and test $count -lt $argv[2]
            return
        end
        set count (math $count + 1)
    end
    return 1
end

function __flexsim_files  # folders, and files that end so
    __fish_complete_suffix .$argv[1] | string match -r -- "^[^\t]*(?:/|\.$argv[1])(?:\t.*)?\$"
end

complete -c flexsim -f
"""


def fish_script(words: Sequence[Words]) -> str:
    """Return the script, for fish's folder of completions or to be sourced."""
    lines = [HEAD]
    first = "complete -c flexsim -n __flexsim_first"
    for each in words:
        lines.append(f"{first} -a {each.command} -d {_quoted(each.about)}")
    lines += [line for each in words for line in _lines(each)]
    return "\n".join([*lines, ""])


def _lines(words: Words) -> Iterator[str]:
    """Give the lines of a command."""
    of = f"complete -c flexsim -n {_quoted(f'__flexsim_is {words.command}')}"
    for flag in words.flags:
        names = " ".join(f"-l {name.removeprefix('--')}" for name in flag.names)
        value = f" -x -a {_quoted(_values(flag))}" if flag.most else ""
        yield f"{of} {names} -d {_quoted(flag.about)}{value}"
        if flag.most > 1 and _values(flag):
            test = f"__flexsim_more {words.command} {flag.most} {' '.join(flag.names)}"
            yield f"complete -c flexsim -n {_quoted(test)} -a {_quoted(_values(flag))}"
    for place in words.places:
        yield f"{of} -a {_quoted(_values(place))}"


def _values(flag: Flag) -> str:
    """Return what is offered as a value: names, and commands of fish that list files."""
    files = {
        None: "",
        "": "(__fish_complete_path (commandline -ct))",
        "/": "(__fish_complete_directories (commandline -ct))",
    }
    found = files.get(flag.ending, f"(__flexsim_files {(flag.ending or '')[1:]})")
    return " ".join([*flag.values, found]).strip()


def _quoted(text: str) -> str:
    """Return a text as one word of fish."""
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"
