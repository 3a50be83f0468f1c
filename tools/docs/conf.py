"""Settings of the documents' site for Sphinx 5 and myst-parser 0.18. make_site.py copies this file to the root of the
documents that it has gathered."""

from docutils import nodes

project = "freeflex"
author = "the freeflex authors"
extensions = ["myst_parser", "sphinx.ext.mathjax"]
source_suffix = {".md": "markdown"}
root_doc = "index"

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4  # the same anchors as GitHub's, so that links work in both places
myst_update_mathjax = False  # myst's settings are for MathJax 3, but the site uses MathJax 2
suppress_warnings = ["myst.header"]  # a page may begin with a heading below the top level, if another page includes it

html_theme = "sphinx_rtd_theme"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_title = "freeflex"
html_show_sourcelink = False
html_show_copyright = False
html_copy_source = False
html_use_index = False
html_theme_options = {"navigation_depth": 3, "collapse_navigation": False}

# SVG output: scripts contain the glyphs as paths, so that no font file is read; a browser would refuse that over
# file://
mathjax_path = "mathjax/MathJax.js?config=TeX-AMS_SVG"
mathjax2_config = {"showMathMenu": False, "messageStyle": "none",
                   "SVG": {"scale": 95, "linebreaks": {"automatic": True}}}


def keep_tags(app, document):
    """Keeps display equations as they are written. Otherwise Sphinx would wrap an equation of several lines in a
    `split`, in which MathJax allows no `\\tag`. Gives each tagged equation the anchor `eq-NUMBER`."""
    for block in document.findall(nodes.math_block):
        text = block.astext().strip()
        if r"\tag{" in text:
            number = text.split(r"\tag{", 1)[1].split("}", 1)[0]
            block["ids"].append("eq-" + number.replace(".", "-"))
        block["nowrap"] = True
        block.children = [nodes.Text(r"\[" + text + r"\]")]


def setup(app):
    app.connect("doctree-read", keep_tags)
