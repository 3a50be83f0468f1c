#!/usr/bin/env python3
"""site_test.py SITE: opens the site of the documentation over file:// in Chromium without a window, searches it, and checks
its equations. The exit code is 77 if there is no Chromium."""

import os
import re
import shutil
import subprocess
import sys
import tempfile


def page(browser, site, path):
    """Returns the page after its scripts have run."""
    with tempfile.TemporaryDirectory() as profile:
        return subprocess.run([browser, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={profile}",
                               "--virtual-time-budget=20000", "--dump-dom", f"file://{site}/{path}"], check=True,
                              capture_output=True, text=True, timeout=120).stdout


def main():
    site = os.path.abspath(sys.argv[1])
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    if not browser:
        print("skipped: there is no chromium; apt-get install chromium")
        sys.exit(77)
    found = page(browser, site, "search.html?q=lease")
    pages = re.findall(r'<li[^>]*><a href="([^"]+)"', found.split('class="search"', 1)[1])
    assert any(one.startswith("messages/README.html") for one in pages), f"a search for lease found {pages}"
    assert any(one.startswith("tools/docs/tutorial.html") for one in pages), f"a search for lease found {pages}"
    nothing = page(browser, site, "search.html?q=zyzzyva")
    assert "did not match any documents" in nothing, "a search for a word that is nowhere finds something"
    theory = page(browser, site, "core/THEORY.html")
    drawn, equations = theory.count('class="MathJax_SVG"'), theory.count('class="math notranslate')
    errors = re.findall(r'data-mjx-error|class="merror"', theory)
    assert equations > 200 and drawn >= equations, f"{drawn} of {equations} equations are drawn"
    assert not errors, f"{len(errors)} equations have errors"
    outside = re.findall(r'(?:src|href)="(https?:[^"]*)"[^>]*(?:rel="stylesheet"|></script>)', found + theory)
    assert not outside, f"the site loads {outside}"
    print(f"search works, {equations} equations are drawn")


if __name__ == "__main__":
    main()
