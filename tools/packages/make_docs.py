#!/usr/bin/env python3
"""make_docs.py SOURCE OUTPUT CMARK: the project's documents as HTML by CMARK (cmark-gfm), with an index of all headings;
nothing is loaded from elsewhere."""

import html
import os
import re
import shutil
import subprocess
import sys

# what is read, in the order of the index, and what it is
DOCUMENTS = [
    ("README.md", "first steps, promises, when not to trust it"),
    ("service/scenes/README.md", "how a scene is written"),
    ("tools/README.md", "every command and its options"),
    ("tools/python/README.md", "the Python package"),
    ("messages/README.md", "the messages: interface control document"),
    ("service/README.md", "the daemon: what runs, how to run it well"),
    ("service/SECURITY.md", "who may command"),
    ("core/README.md", "the method: structure, words, limits, decisions"),
    ("core/THEORY.md", "every equation, with its source and its code"),
    ("tools/report/README.md", "error against run time, with figures"),
    ("tests/README.md", "every promise with its figure and its test"),
    ("CHANGELOG.md", "what changed"),
]

STYLE = """
body { max-width: 60em; margin: 2em auto; padding: 0 1em; font: 16px/1.5 system-ui, sans-serif; color: #222; }
code, pre { font-family: ui-monospace, monospace; font-size: 0.9em; background: #f4f4f6; }
pre { padding: 0.7em; overflow-x: auto; }
table { border-collapse: collapse; display: block; overflow-x: auto; }
th, td { border: 1px solid #ccc; padding: 0.2em 0.6em; text-align: left; vertical-align: top; }
nav { margin-bottom: 1.5em; } a { color: #0b57a4; } img { max-width: 100%; } input { font: inherit; width: 100%; }
"""

PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{title}</title>
<style>{style}</style></head><body>
{body}
</body></html>
"""

# the index: what does not hold every word that is looked for is hidden
SEARCH = """<script>
document.getElementById("words").oninput = ({ target }) => {
  const words = target.value.toLowerCase().split(/\\s+/);
  for (const item of document.querySelectorAll("li"))
    item.hidden = !words.every((word) => item.textContent.toLowerCase().includes(word));
};
</script>"""


def anchor(heading):
    """As the links of the documents have it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def page_of(path):
    return path[:-len(".md")].replace("/", "-") + ".html"


def mend_link(link, path, pages):
    """A link of a document at `path`: to a page where there is one, as it is where it leads elsewhere."""
    target, _, part = link.partition("#")
    if not target or "://" in target:
        return link
    whole = os.path.normpath(os.path.join(os.path.dirname(path), target))
    if whole in pages:
        return page_of(whole) + ("#" + part if part else "")
    return os.path.basename(target)


def convert(cmark, source, path, pages):
    """A document as HTML; its headings as (level, text); the files beside it that it shows."""
    text = subprocess.run([cmark, "-e", "table", "-e", "autolink", os.path.join(source, path)], check=True,
                          capture_output=True, text=True).stdout
    headings, files = [], []

    def heading(match):
        level, inner = int(match[1]), match[2]
        plain = html.unescape(re.sub(r"<[^>]*>", "", inner))
        headings.append((level, plain))
        return f'<h{level} id="{html.escape(anchor(plain))}">{inner}</h{level}>'

    def link(match):
        mended = mend_link(html.unescape(match[2]), path, pages)
        if match[1] == "src" or not (mended.partition("#")[0].endswith(".html") or "://" in mended or mended[0] == "#"):
            files.append(os.path.join(os.path.dirname(path), html.unescape(match[2]).partition("#")[0]))
        return f'{match[1]}="{html.escape(mended)}"'

    text = re.sub(r"<h([1-6])>(.*?)</h\1>", heading, text, flags=re.S)
    return re.sub(r'(href|src)="([^"]*)"', link, text), headings, files


def leads_on(link, path, output, anchors):
    page, _, part = link.partition("#")
    page = page or page_of(path)
    return os.path.exists(os.path.join(output, page)) and (not part or part in anchors.get(page, ()))


def main():
    source, output, cmark = sys.argv[1:]
    pages = [path for path, _ in DOCUMENTS]
    os.makedirs(output, exist_ok=True)
    index, links, anchors = "", [], {}
    for path, about in DOCUMENTS:
        body, headings, files = convert(cmark, source, path, pages)
        for file in files:
            if os.path.isfile(os.path.join(source, file)):
                shutil.copy(os.path.join(source, file), output)
        anchors[page_of(path)] = {anchor(text) for _, text in headings}
        links += [(path, html.unescape(link)) for link in re.findall(r'href="([^"]*)"', body)]
        title = headings[0][1] if headings else path
        with open(os.path.join(output, page_of(path)), "w", encoding="utf-8") as file:
            file.write(PAGE.format(title=html.escape(title), style=STYLE,
                                   body=f'<nav><a href="index.html">freeflex documents</a></nav>\n{body}'))
        index += f'<h2><a href="{page_of(path)}">{html.escape(title)}</a></h2>\n<p>{html.escape(about)}</p>\n<ul>\n'
        index += "".join(f'<li><a href="{page_of(path)}#{html.escape(anchor(text))}">{html.escape(text)}</a></li>\n'
                         for level, text in headings if level > 1) + "</ul>\n"
    broken = [f"{path}: {link}" for path, link in links if "://" not in link and not leads_on(link, path, output, anchors)]
    if broken:
        sys.exit("make_docs.py: links that lead nowhere:\n  " + "\n  ".join(broken))
    with open(os.path.join(output, "index.html"), "w", encoding="utf-8") as file:
        file.write(PAGE.format(title="freeflex documents", style=STYLE, body="<h1>freeflex documents</h1>\n"
                               '<p><input id="words" placeholder="words of a heading"></p>\n' + index + SEARCH))


if __name__ == "__main__":
    main()
