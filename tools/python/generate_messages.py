#!/usr/bin/env python3
"""generate_messages.py OUTPUT FILE.lcm...: writes the Python module of the message types.

Reads the part of LCM's language that the .lcm files of freeflex use: one struct per file, constants, and arrays whose
size is fixed or given by a count. Anything else is an error with file and line. The fingerprints equal those of
lcm-gen: a hash over names and types of fields and over the structs inside.
"""

import os
import re
import sys

PRIMITIVES = ("int8_t", "int16_t", "int32_t", "int64_t", "byte", "float", "double", "string", "boolean")
MASK = (1 << 64) - 1

FIELD = re.compile(r"^\s*(\w+)\s+(\w+)((?:\[\w+\])*);\s*(?://\s*(.*?))?\s*$")
CONSTANTS = re.compile(r"^\s*const\s+int32_t\s+([^;]+);\s*$")
MORE = re.compile(r"^\s*//\s*(.*?)\s*$")


class Type:
    """One struct: fields (name, type, sizes, comment), constants and the comment above the struct."""

    def __init__(self, name, about):
        self.name, self.about = name, about
        self.fields, self.constants = [], []


def fail(file, line, what):
    sys.exit(f"{file}:{line}: {what}")


def parse(file):
    """Returns the struct of one file."""
    result, about, inside = None, [], False
    with open(file, encoding="utf-8") as lines:
        for number, line in enumerate(lines, 1):
            if not line.strip() or line.strip() in ("package freeflex_msgs;", "{", "}"):
                inside = inside or line.strip() == "{"
                continue
            if not inside and (comment := MORE.match(line)):
                about.append(comment.group(1))
            elif not inside and (struct := re.match(r"^struct (\w+)$", line)):
                result = Type(struct.group(1), " ".join(about))
            elif inside and (constants := CONSTANTS.match(line)):
                for one in constants.group(1).split(","):
                    name, value = one.split("=")
                    result.constants.append((name.strip(), int(value)))
            elif inside and (comment := MORE.match(line)) and result.fields:
                name, kind, sizes, before = result.fields[-1]
                result.fields[-1] = (name, kind, sizes, f"{before} {comment.group(1)}")
            elif inside and (field := FIELD.match(line)):
                kind, name, sizes, comment = field.groups()
                sizes = [int(s) if s.isdigit() else s for s in re.findall(r"\[(\w+)\]", sizes)]
                known = [name for name, *_ in result.fields]
                for size in sizes:
                    if isinstance(size, str) and size not in known:
                        fail(file, number, f"the size {size} of {name} is not an earlier field")
                result.fields.append((name, kind, sizes, comment or ""))
            else:
                fail(file, number, f"this line is not in the supported part of the language: {line.strip()}")
    if result is None:
        fail(file, 1, "the file has no struct")
    return result


def add(v, c):
    """Returns the hash after one step of LCM's algorithm, computed with signed 64-bit integers."""
    shifted = (v << 8) & MASK
    spread = v >> 55 if v < 1 << 63 else (v >> 55) | (MASK ^ 0x1FF)
    return ((shifted ^ spread) + c) & MASK


def add_text(v, text):
    v = add(v, len(text))
    for c in text.encode():
        v = add(v, c)
    return v


def base_hash(one):
    v = 0x12345678
    for name, kind, sizes, _ in one.fields:
        v = add_text(v, name)
        if kind in PRIMITIVES:
            v = add_text(v, kind)
        v = add(v, len(sizes))
        for size in sizes:
            v = add(v, 0 if isinstance(size, int) else 1)
            v = add_text(v, str(size))
    return v


def fingerprint(one, types, parents=()):
    if one.name in parents:
        return 0
    v = base_hash(one)
    for _, kind, _, _ in one.fields:
        if kind not in PRIMITIVES:
            v = (v + fingerprint(types[kind], types, (*parents, one.name))) & MASK
    return ((v << 1) & MASK) + (v >> 63) & MASK


def size_text(size):
    return str(size) if isinstance(size, int) else f'"{size}"'


def text_of(one, types):
    counters = {size for *_, sizes, _ in one.fields for size in sizes if isinstance(size, str)}
    lines = [f"class {one.name}(Message):", f'    """{one.about or "Part of other messages."}', ""]
    for name, kind, sizes, comment in one.fields:
        if name in counters:
            continue
        shape = "".join(f"[{size}]" for size in sizes)
        lines.append(f"    {name}: {kind}{shape}" + (f"  {comment}" if comment else ""))
    lines += ['    """', "", f"    FINGERPRINT = 0x{fingerprint(one, types):016x}", "    FIELDS = ("]
    for name, kind, sizes, _ in one.fields:
        shape = ", ".join(size_text(size) for size in sizes)
        lines.append(f'        ("{name}", "{kind}", ({shape}{"," if len(sizes) == 1 else ""})),')
    lines.append("    )")
    lines += [f"    {name} = {value}" for name, value in one.constants]
    return "\n".join(lines)


def in_order(types):
    """Returns the structs in an order in which each precedes the structs that contain it."""
    done = []

    def visit(one):
        for _, kind, _, _ in one.fields:
            if kind not in PRIMITIVES:
                visit(types[kind])
        if one not in done:
            done.append(one)

    for name in sorted(types):
        visit(types[name])
    return done


def main():
    output, files = sys.argv[1], sys.argv[2:]
    types = {}
    for file in files:
        one = parse(file)
        types[one.name] = one
    for one in types.values():
        for name, kind, _, _ in one.fields:
            if kind not in PRIMITIVES and kind not in types:
                sys.exit(f"{one.name}.{name}: no file has the type {kind}")
    parts = ['"""The messages of freeflex, generated from messages/*.lcm: fields, units, constants."""\n\n'
             "from freeflex.codec import Message, index_types"]
    parts += [text_of(one, types) for one in in_order(types)]
    parts.append("#: all message types by name\nTYPES = index_types("
                 + ", ".join(sorted(types)) + ")\n")
    os.makedirs(os.path.dirname(output) or ".", exist_ok=True)
    with open(output, "w", encoding="utf-8") as file:
        file.write("\n\n\n".join(parts))


if __name__ == "__main__":
    main()
