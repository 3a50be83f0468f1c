#!/usr/bin/python3
"""validate.py SCHEMA TEXTS: validates scenes with a JSON Schema, as an editor does.

TEXTS is a JSON list of scenes in YAML. Prints a JSON list with an entry for each: "" if the schema accepts it, the
first fault if it refuses it, null if it is not YAML.
"""
import json
import re
import sys

import jsonschema
import yaml


class Core(yaml.SafeLoader):
    """Loads YAML 1.2, in which 1e5 is a number and y is text. Keys stay text."""

    yaml_implicit_resolvers = {}

    def construct_mapping(self, node, deep=False):
        self.flatten_mapping(node)
        return {key.value: self.construct_object(value, deep=True) for key, value in node.value}

    def construct_map(self, node):
        return self.construct_mapping(node)

    def construct_whole(self, node):
        return int(node.value, 0 if node.value[:2] in ("0o", "0x") else 10)

    def construct_float(self, node):
        return float(node.value.lower().replace(".inf", "inf").replace(".nan", "nan"))


def resolve(tag, pattern):
    Core.add_implicit_resolver("tag:yaml.org,2002:" + tag, re.compile(f"^(?:{pattern})$"), None)


resolve("merge", "<<")
resolve("null", "~|null|Null|NULL|")
resolve("bool", "true|True|TRUE|false|False|FALSE")
resolve("int", "[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
resolve("float", r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)")
Core.add_constructor("tag:yaml.org,2002:map", Core.construct_map)
Core.add_constructor("tag:yaml.org,2002:int", Core.construct_whole)
Core.add_constructor("tag:yaml.org,2002:float", Core.construct_float)


def read(text):
    try:
        return json.loads(text)
    except ValueError:
        return yaml.load(text, Core)


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        schema = json.load(file)
    jsonschema.Draft7Validator.check_schema(schema)
    validator = jsonschema.Draft7Validator(schema)
    with open(sys.argv[2], encoding="utf-8", errors="surrogateescape") as file:
        texts = json.load(file)
    faults = []
    for text in texts:
        try:
            scene = read(text)
        except (yaml.YAMLError, ValueError, RecursionError):
            faults.append(None)
            continue
        fault = next(validator.iter_errors(scene), None)
        faults.append("" if fault is None else f"{'/'.join(map(str, fault.path))}: {fault.message[:200]}")
    json.dump(faults, sys.stdout)


main()
