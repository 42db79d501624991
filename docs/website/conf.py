"""Settings of the documentation as a site: `./run docs --site`."""

import fotismos  # isort: skip  it finds LLVM before Dr.Jit is imported

from fotismos.reference.scene.graph import set_variant

set_variant("llvm_ad_rgb")  # some modules cannot be imported without one

project = "fotismos"
release = fotismos.__version__
html_title = f"{project} {release}"
html_theme = "furo"
html_theme_options = {
    f"{scheme}_css_variables": {
        "font-stack": "system-ui, sans-serif",
        "color-brand-primary": accent,
        "color-brand-content": accent,
        "color-brand-visited": accent,
    }
    for scheme, accent in (("light", "#1a56a0"), ("dark", "#8ab8f0"))
}
html_copy_source = False
html_show_copyright = False

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "docs.website.references",
    "docs.website.typeset",
]
nitpicky = True
nitpick_ignore_regex = [
    # Names in signatures of click, which its own pages do not list.
    ("py:class", r"t\.(Any|Callable)|_AnyCallable|CmdType|Command"),
    # Names that modules give to types for the checker alone.
    ("py:class", r"Rule|Sites|AnyStudy"),
]
default_role = "code"
highlight_language = "text"  # of blocks that name none: commands
myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath"]
html_math_renderer = "svg"

add_module_names = False
python_maximum_signature_line_length = 88
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
autodoc_inherit_docstrings = False  # click's speak of click's own names
autodoc_default_options = {
    "members": True,
    "ignore-module-all": True,  # names are documented where they are defined
}
napoleon_google_docstring = False
napoleon_use_param = False  # parameters that share a description stay together
napoleon_use_rtype = False
napoleon_custom_sections = [("Attributes", "params_style")]
