#!/usr/bin/env python3
"""make_page.py OUTPUT ESBUILD DYGRAPHS: writes the page as one file, with its script bundled and dygraphs included."""

import os
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def main():
    output, esbuild, dygraphs = sys.argv[1:]
    script = subprocess.run([esbuild, os.path.join(HERE, "main.js"), "--bundle", "--format=iife", "--minify",
                             "--target=es2020", "--log-level=warning"], check=True, capture_output=True, text=True).stdout
    page = read(os.path.join(HERE, "index.html"))
    style = read(os.path.join(HERE, "style.css")) + read(os.path.join(dygraphs, "dygraph.css"))
    for mark, text in (("@STYLE@", style), ("@DYGRAPHS@", read(os.path.join(dygraphs, "dygraph.min.js"))),
                       ("@SCRIPT@", script)):
        # a browser ends a script at the first </script, even inside a string
        page = page.replace(mark, text.replace("</script", "<\\/script"))
    with open(output, "w", encoding="utf-8") as file:
        file.write(page)


if __name__ == "__main__":
    main()
