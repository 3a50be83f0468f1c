#!/usr/bin/env python3
"""make_site.py SOURCE BIN OUTPUT: builds the documents as one HTML site that needs no network.

SOURCE is the top of the tree, BIN the folder with the programs, whose --help becomes the reference of commands, and
OUTPUT the folder of the site. Copies every document of the tree to a folder next to OUTPUT, generates the reference
pages there, and runs Sphinx on that folder. If a link has no target, ends with exit code 1."""

import os
import re
import shutil
import subprocess
import sys

import reference

HERE = os.path.dirname(os.path.abspath(__file__))
MATHJAX = "/usr/share/javascript/mathjax"
# the files that the SVG output of MathJax 2 reads: 3 MB of 54 MB
MATHJAX_PARTS = ["MathJax.js", "config/TeX-AMS_SVG.js", "extensions", "jax/element", "jax/input/TeX",
                 "jax/output/SVG/autoload", "jax/output/SVG/config.js", "jax/output/SVG/jax.js",
                 "jax/output/SVG/fonts/TeX"]
LINK = re.compile(r"(\[[^\]]*\]\()([^)#\s]+)(#[^)\s]*)?(\))")


def find_documents(source):
    """Returns the paths of all documents below `source`, relative to `source`. Omits builds, hidden folders and the
    notes on commands, which are parts of a page."""
    found = []
    for folder, folders, files in os.walk(source):
        folders[:] = [name for name in folders if name[0] != "." and name not in ("build", "node_modules", "commands")]
        found += [os.path.relpath(os.path.join(folder, name), source) for name in files if name.endswith(".md")]
    return sorted(found)


def moved_page(path):
    """Returns the place in the site, with an anchor, of a document that is not a page of its own; empty for any other
    document."""
    if path == "tools/docs/README.md":
        return "index.md"
    folder, name = os.path.split(path)
    if folder != "tools/docs/commands":
        return ""
    name = name[:-len(".md")]
    return "tools/docs/reference/commands.md" + ("" if name == "rules" else
                                                 "#" + name if name == "freeflexd" else "#freeflex-" + name)


def gather(source, path, stage):
    """Copies one document and the pictures that it shows. A link to a file or folder that is not a page of the site is
    replaced by its text."""
    with open(os.path.join(source, path), encoding="utf-8") as file:
        text = file.read()

    def mend(match):
        target = match[2]
        if "://" in target:
            return match[0]
        whole = os.path.normpath(os.path.join(source, os.path.dirname(path), target))
        if not os.path.exists(whole) and "tools/docs/reference/" not in whole:
            sys.exit(f"make_site.py: {path} links to {target}, which does not exist")
        inside = os.path.relpath(whole, source)
        if moved := moved_page(inside):
            return match[1] + os.path.relpath(moved, os.path.dirname(path)) + match[4]
        if os.path.isdir(whole) and os.path.exists(os.path.join(whole, "README.md")):
            return f"{match[1]}{target.rstrip('/')}/README.md{match[3] or ''}{match[4]}"
        if whole.endswith((".png", ".svg")):
            copy = os.path.join(stage, inside)
            os.makedirs(os.path.dirname(copy), exist_ok=True)
            shutil.copy(whole, copy)
            return match[0]
        return match[0] if whole.endswith(".md") else match[1][1:-2]

    text = LINK.sub(mend, text)
    text = re.sub(r"^```math\n(.*?)^```$", r"$$\n\1$$", text, flags=re.M | re.S)  # GitHub's form of display equations
    copy = os.path.join(stage, path)
    os.makedirs(os.path.dirname(copy), exist_ok=True)
    with open(copy, "w", encoding="utf-8") as file:
        file.write(text)


def write_index(stage):
    """Makes the front page and the site's navigation from the lists of links in tools/docs/README.md."""
    path = os.path.join(stage, "tools/docs/README.md")
    with open(path, encoding="utf-8") as file:
        text = re.sub(r"\]\(([^):]+)\)",
                      lambda match: "](" + os.path.normpath(os.path.join("tools/docs", match[1])) + ")", file.read())
    os.remove(path)
    for section in text.split("\n## ")[1:]:
        pages = re.findall(r"^- \[[^\]]*\]\(([^)]+)\.md\)", section, flags=re.M)
        text += "\n```{toctree}\n:hidden:\n:maxdepth: 1\n:caption: " + section.split("\n", 1)[0] + "\n" + \
            "\n".join(pages) + "\n```\n"
    with open(os.path.join(stage, "index.md"), "w", encoding="utf-8") as file:
        file.write(text)


def copy_mathjax(static):
    for part in MATHJAX_PARTS:
        whole, copy = os.path.join(MATHJAX, part), os.path.join(static, "mathjax", part)
        os.makedirs(os.path.dirname(copy), exist_ok=True)
        if os.path.isdir(whole):
            shutil.copytree(whole, copy)
        else:
            shutil.copy(whole, copy)


def main():
    if len(sys.argv) != 4:
        sys.exit("usage: make_site.py SOURCE BIN OUTPUT")
    source, programs, output = (os.path.abspath(path) for path in sys.argv[1:])
    stage = output + ".stage"
    for folder in (stage, output):
        shutil.rmtree(folder, ignore_errors=True)
    for path in find_documents(source):
        gather(source, path, stage)
    reference.write(source, programs, os.path.join(stage, "tools/docs/reference"))
    write_index(stage)
    static = os.path.join(stage, "_static")
    os.makedirs(static)
    shutil.copy(os.path.join(HERE, "site.css"), static)
    shutil.copy(os.path.join(HERE, "conf.py"), stage)
    copy_mathjax(static)
    done = subprocess.run(["sphinx-build", "-q", "-W", "--keep-going", "-j", "auto", "-b", "html", "-d",
                           stage + ".doctrees", stage, output], check=False)
    shutil.rmtree(stage + ".doctrees", ignore_errors=True)
    if done.returncode != 0:
        sys.exit(1)
    shutil.rmtree(stage)


if __name__ == "__main__":
    main()
