"""The reference pages that are generated: scene keys from the table of keys (`freeflex schema`), messages from the
`.lcm` files, command lines from `--help`."""

import json
import os
import re
import subprocess


def run(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def cell(text):
    return text.replace("|", "\\|").replace("\n", " ")


# Scene keys

def described(schema, definitions):
    """Returns the description of a value and, if the value may be an object, a list of objects or one of several
    objects, their keys."""
    if "$ref" in schema:
        name = schema["$ref"].rsplit("/", 1)[1]
        text, objects = described(definitions[name], definitions)
        return schema.get("description", text), objects or []
    objects = [schema] if schema.get("properties") else []
    for choice in schema.get("anyOf", []) + schema.get("oneOf", []) + schema.get("allOf", []) + [schema.get("items", {})]:
        if isinstance(choice, dict) and choice:
            objects += described(choice, definitions)[1]
    return schema.get("description", ""), objects


def values_of(schema):
    return ", ".join(f"`{value}`" for value in schema.get("enum", []))


def key_tables(name, schema, definitions, level):
    """Yields Markdown for a key whose value has keys of its own: one table for each kind of item."""
    text, objects = described(schema, definitions)
    yield f"{'#' * level} {name}\n\n{text}\n"
    for item in objects:
        required = set(item.get("required", []))
        if item.get("description") and item["description"] != text:
            yield f"{item['description']}\n"
        yield "| key | meaning |\n|---|---|"
        deeper = []
        for key, value in item["properties"].items():
            about, inner = described(value, definitions)
            choices = values_of(value)
            mark = " (required)" if key in required else ""
            yield f"| `{key}`{mark} | {cell(about)}{' One of ' + choices + '.' if choices else ''} |"
            if inner:
                deeper.append((key, value))
        yield ""
        for key, value in deeper:
            yield from key_tables(f"{name}: {key}", value, definitions, min(level + 1, 4))


def scene_keys(programs):
    schema = json.loads(run(os.path.join(programs, "freeflex"), "schema"))
    definitions, tables, simple = schema["definitions"], [], []
    for key, value in schema["properties"].items():
        text, objects = described(value, definitions)
        if objects:
            tables += key_tables(key, value, definitions, 2)
        else:
            choices = values_of(value)
            simple.append(f"| `{key}` | {cell(text)}{' One of ' + choices + '.' if choices else ''} |")
    return "\n".join([
        "# Scene keys", "",
        "Every key of a scene, with meaning, unit and range. `freeflex schema` writes the same table as a JSON Schema, "
        "with which editors complete and check scenes. How a scene is written: [the language of scenes]"
        "(../../../service/scenes/README.md).", "",
        "## Keys of the scene itself", "", "| key | meaning |", "|---|---|", *simple, "", *tables,
        "## Paths", "",
        "`--set PATH=VALUE` of `freeflexd`, `check`, `modes`, `compile` and `run` sets one of these values.", "",
        "```", *schema["x-paths"]["paths"], "```", ""])


# Messages

FIELD = re.compile(r"^\s*(?P<type>[\w.]+)\s+(?P<name>\w+)(?P<sizes>(?:\[\w+\])*)\s*;\s*(?://\s*(?P<about>.*))?$")
CONSTANTS = re.compile(r"^\s*const\s+(?P<type>\w+)\s+(?P<values>[^;]*);")


def message_page(source):
    """Returns Markdown for every type of the `.lcm` files: first the messages on channels, then the types inside
    them."""
    folder = os.path.join(source, "messages")
    sent, held = [], []
    for name in sorted(os.listdir(folder)):
        if not name.endswith(".lcm"):
            continue
        with open(os.path.join(folder, name), encoding="utf-8") as file:
            page, about = message_type(file.read().splitlines())
        (sent if about.startswith("FREEFLEX_") else held).append(page)
    return "\n".join([
        "# Message types", "",
        "Every field of every message, with its unit, from the `.lcm` files. Meaning of the messages: "
        "[the interface control document](../../../messages/README.md).", "",
        "## Messages on channels", "", *sent, "## Types inside messages", "", *held])


def message_type(lines):
    about, rows, constants, name = [], [], [], ""
    for line in lines:
        comment = re.match(r"^\s*//\s?(.*)$", line)
        field, constant = FIELD.match(line), CONSTANTS.match(line)
        if line.startswith("struct"):
            name = line.split()[1]
        elif comment and not name:
            about.append(comment[1])
        elif comment and rows:
            rows[-1][2] += " " + comment[1].strip()
        elif constant:
            constants.append(constant["values"])
        elif field and name:
            rows.append([field["type"] + field["sizes"], field["name"], field["about"] or ""])
    text = " ".join(about)
    table = [f"| `{name}` | `{kind}` | {cell(meaning)} |" for kind, name, meaning in rows]
    page = [f"### {name}", "", text, "", "| field | type | meaning |", "|---|---|---|", *table, ""]
    page += ["Constants: " + ", ".join(f"`{value.strip()}`" for value in ",".join(constants).split(",")) + ".", ""] \
        if constants else []
    return "\n".join(page), text


# Command lines

def commands_page(source, programs):
    """Returns Markdown for every command: its --help, then the notes in tools/docs/commands if there are any."""
    freeflex = os.path.join(programs, "freeflex")
    whole = run(freeflex, "--help")
    listed = whole.split("Subcommands:", 1)[1].split("\n\n", 1)[0]
    names = re.findall(r"^  (\w+)\s", listed, flags=re.M)
    pages = [("freeflexd", [os.path.join(programs, "freeflexd")])]
    pages += [(f"freeflex {name}", [freeflex, name]) for name in names]
    parts = ["# Commands", "", read(os.path.join(source, "tools/docs/commands/rules.md")), "", "## freeflex", "",
             "```text", whole.rstrip(), "```", ""]
    for title, command in pages:
        parts += [f"## {title}", "", "```text", run(*command, "--help").rstrip(), "```", ""]
        notes = os.path.join(source, "tools/docs/commands", title.replace("freeflex ", "") + ".md")
        if os.path.exists(notes):
            parts += [read(notes), ""]
    return "\n".join(parts)


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read().strip()


def write(source, programs, folder):
    """Writes the reference pages into `folder`."""
    os.makedirs(folder)
    for name, text in [("scene_keys.md", scene_keys(programs)), ("message_types.md", message_page(source)),
                       ("commands.md", commands_page(source, programs))]:
        with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
            file.write(text)
