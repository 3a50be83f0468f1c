#!/usr/bin/env python3
"""Makes manual pages and completion for bash from the --help of the programs.

  from_help.py man OUTPUT PROGRAM    a manual page of a program with its subcommands
  from_help.py bash OUTPUT PROGRAM...
"""

import json
import os
import re
import subprocess
import sys

OPTION = re.compile(r"^  ((?:-\w,)?--[\w-]+)(?:[ =](\S.*?))?(?:\s{2,}|$)")
ABOUT = {
    "freeflex": "scenes, plans, runs and recordings of free flexible structures",
    "freeflexd": "simulates a free flexible structure in real time, controlled and observed over LCM",
}


def help_of(program, *arguments):
    return subprocess.run([program, *arguments, "--help"], check=True, capture_output=True, text=True).stdout


def subcommands(text):
    """Returns the names and meanings in the list of subcommands of a help text."""
    found, inside = [], False
    for line in text.splitlines():
        if line == "Subcommands:":
            inside = True
        elif inside and (match := re.match(r"^  ([a-z]+)\s{2,}(.*)$", line)):
            found.append(match.groups())
        elif inside and not line.strip():
            inside = False
    return found


def troff(text):
    """Escapes a text for troff."""
    lines = text.rstrip("\n").replace("\\", "\\e").replace("-", "\\-").split("\n")
    return "\n".join(("\\&" + line) if line[:1] in (".", "'") else line for line in lines)


def verbatim(text):
    return f".nf\n.ft CW\n{troff(text)}\n.ft\n.fi\n"


def sections(text):
    """Splits the help of one command into description, usage, and the rest."""
    lines = text.splitlines()
    usage = next((line for line in lines if line.startswith("Usage: ")), "")
    about = " ".join(lines[:lines.index(usage)]) if usage in lines else ""
    rest = "\n".join(lines[lines.index(usage) + 1:] if usage in lines else lines).strip("\n")
    return about, usage.removeprefix("Usage: "), rest


def man(output, program):
    name = os.path.basename(program)
    version = subprocess.run([program, "--version"], check=True, capture_output=True, text=True).stdout.split()[-1]
    text = help_of(program)
    about, usage, rest = sections(text)
    page = f'.TH {name.upper()} 1 "" "freeflex {version}" "User Commands"\n'
    page += f".SH NAME\n{name} \\- {troff(ABOUT[name])}\n"
    page += f".SH SYNOPSIS\n{verbatim(usage)}"
    page += f".SH DESCRIPTION\n{verbatim(rest)}"
    for command, meaning in subcommands(text):
        _, usage, rest = sections(help_of(program, command))
        page += f".SH {troff(name + ' ' + command).upper()}\n{troff(meaning)}\n.PP\n{verbatim(usage)}.PP\n{verbatim(rest)}"
    page += ".SH SEE ALSO\nThe documents of the package, and its scenes: /usr/share/doc/freeflex, /usr/share/freeflex.\n"
    with open(output, "w", encoding="utf-8") as file:
        file.write(page)


def options(text):
    """Returns the options in a help text: name -> argument, empty for a flag."""
    found = {}
    for line in text.splitlines():
        if match := OPTION.match(line):
            name = match.group(1).split(",")[-1]
            found[name] = match.group(2) or ""
    return found


def takes_file(argument):
    return "=" not in argument and any(word in argument for word in ("FILE", "FOLDER", "LOG", "PATH", "DIR"))


def paths_of_values(program):
    """Returns the paths that --set accepts, with the equals sign."""
    schema = json.loads(subprocess.run([program, "schema"], check=True, capture_output=True, text=True).stdout)
    return [f"{path}=" for path in schema["x-paths"]["paths"]]


def bash(output, programs):
    paths = " ".join(paths_of_values(next(each for each in programs if os.path.basename(each) == "freeflex")))
    text = "# Completion of freeflex for bash, made from --help.\n"
    for program in programs:
        name = os.path.basename(program)
        function = f"_{name}".replace("-", "_")
        whole = help_of(program)
        commands = {command: options(help_of(program, command)) for command, _ in subcommands(whole)}
        cases = "".join(f'    {command}) words="{" ".join(found)}" ;;\n' for command, found in commands.items())
        everything = {**options(whole), **{o: a for found in commands.values() for o, a in found.items()}}
        with_value = [o for o, a in everything.items() if a and not takes_file(a) and o != "--set"]
        text += f"""
{function}() {{
  local current="${{COMP_WORDS[COMP_CWORD]}}" before="${{COMP_WORDS[COMP_CWORD-1]}}" words command= file k
  for ((k = 1; k < COMP_CWORD; ++k)); do
    case "${{COMP_WORDS[k]}}" in -*) ;; *) command="${{COMP_WORDS[k]}}"; break ;; esac
  done
  case "$before" in --set) compopt -o nospace; COMPREPLY=($(compgen -W "{paths}" -- "$current")); return ;; esac
  case "$before" in {"|".join(with_value) or "--"}) COMPREPLY=(); return ;; esac
  case "$command" in
{cases}    *) words="{" ".join([*commands, *options(whole)])}" ;;
  esac
  COMPREPLY=($(compgen -W "$words" -- "$current"))
  case "$current" in -*) ;; *) {'[ -z "$command" ] || ' if commands else ""}while IFS= read -r file; do COMPREPLY+=("$file"); done < <(compgen -f -- "$current") ;; esac
}}
complete -o filenames -F {function} {name}
"""
    with open(output, "w", encoding="utf-8") as file:
        file.write(text)


def main():
    what, output, *programs = sys.argv[1:]
    man(output, programs[0]) if what == "man" else bash(output, programs)


if __name__ == "__main__":
    main()
