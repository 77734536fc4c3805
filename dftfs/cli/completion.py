"""`dftfs completion`: what a shell needs to complete commands, options and their choices."""

import argparse
import shlex
from collections.abc import Iterator, Mapping

from dftfs.built_in import built_in_names

SHELLS = ("bash", "zsh", "fish")
INSTALL = {
    "bash": 'eval "$(dftfs completion bash)" in ~/.bashrc',
    "zsh": 'eval "$(dftfs completion zsh)" in ~/.zshrc',
    "fish": "dftfs completion fish > ~/.config/fish/completions/dftfs.fish",
}
BASH = """\
# {install}
_dftfs() {{
    local current=${{COMP_WORDS[COMP_CWORD]}} words
    if [ "$COMP_CWORD" -eq 1 ]; then words={commands}; else
    case ${{COMP_WORDS[1]}} in
{cases}
    esac; fi
    COMPREPLY=($(compgen -W "$words" -- "$current"))
}}
complete -o default -F _dftfs dftfs
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("shell", choices=SHELLS, help="shell to write the script for")


def run(arguments: argparse.Namespace) -> int:
    """Print the script."""
    from dftfs.cli.main import SENTENCES, parser

    def own(name: str) -> argparse.ArgumentParser:
        top = parser([name])
        found = next(a for a in top._actions if isinstance(a, argparse._SubParsersAction))
        return found.choices[name]

    print(script(arguments.shell, {name: (SENTENCES[name], own(name)) for name in SENTENCES}))
    return 0


def script(shell: str, commands: Mapping[str, tuple[str, argparse.ArgumentParser]]) -> str:
    """The script for one of `SHELLS`; a path is completed where no word fits.

    Parameters
    ----------
    commands : mapping
        Sentence and parser of each command by its name.
    """
    if shell == "fish":
        return "\n".join([f"# {INSTALL[shell]}", *_fish(commands)])
    cases = [
        f"    {name}) words={shlex.quote(' '.join(dict(completions(parser))))};;"
        for name, (_, parser) in commands.items()
    ]
    text = BASH.format(
        install=INSTALL[shell], commands=shlex.quote(" ".join(commands)), cases="\n".join(cases)
    )
    zsh = "autoload -U +X bashcompinit && bashcompinit\n" if shell == "zsh" else ""
    return zsh + text.rstrip()


def completions(parser: argparse.ArgumentParser) -> Iterator[tuple[str, str]]:
    """Every option, step and choice that a command takes, with its meaning."""
    for place in (parser, *parser.steps()):
        for action in place._actions:
            meaning = (action.help or "").replace("%%", "%")
            for word in action.option_strings:
                yield word, meaning
            if action.choices and not action.option_strings:
                yield from ((str(choice), "") for choice in action.choices)
            if action.dest in ("design", "designs"):
                yield from ((name, "design") for name in built_in_names())


def _fish(commands: Mapping[str, tuple[str, argparse.ArgumentParser]]) -> Iterator[str]:
    for name, (sentence, parser) in commands.items():
        yield f"complete -c dftfs -n __fish_use_subcommand -a {name} -d {shlex.quote(sentence)}"
        seen = f"-n '__fish_seen_subcommand_from {name}'"
        for word, meaning in dict(completions(parser)).items():
            kind = f"-l {word[2:]}" if word.startswith("--") else f"-s {word[1:]}"
            kind = kind if word.startswith("-") else f"-a {shlex.quote(word)}"
            yield f"complete -c dftfs {seen} {kind} -d {shlex.quote(meaning)}"
