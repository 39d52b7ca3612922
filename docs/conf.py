"""How Sphinx makes the site from these pages: `make docs`. What is not here is Sphinx' usual."""

import logging
import os
import sys
from pathlib import Path

from orient_eye import __version__

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

project = "orient-eye"
author = "The orient-eye developers"
project_copyright = author
version = release = __version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "docstrings",
    "elsewhere",
    "made_pages",
    "nothing_outside",
]
exclude_patterns = ["_build"]

# Pages are Markdown that GitHub shows as well; headings have the anchors that they have there.
myst_heading_anchors = 4
myst_enable_extensions: list[str] = []  # no formulas by MathJax: a page loads nothing from elsewhere
highlight_language = "text"
smartquotes = False  # an option begins with two hyphens

# Notebooks are kept without outputs; an error in one fails the build.
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
profile = Path(__file__).parent / "_build" / "ipython" / "profile_default"  # not the one at home
profile.mkdir(parents=True, exist_ok=True)
(profile / "ipython_kernel_config.py").write_text(
    "c.InlineBackend.figure_formats = {'svg'}\nc.IPKernelApp.log_level = 40\n"
)
logging.getLogger("traitlets").setLevel(logging.WARNING)
os.environ["IPYTHONDIR"] = str(profile.parent)

# Docstrings are Google's style with Markdown's backticks: docs/extensions/docstrings.py.
default_role = "py:obj"
autodoc_default_options = {
    "members": True,
    "member-order": "bysource",
    "exclude-members": "differential_evolution",  # scipy's, whose signature cannot be read
}
autodoc_typehints_format = "short"
python_maximum_signature_line_length = 88
add_module_names = False
napoleon_use_rtype = False
napoleon_use_ivar = True
napoleon_attr_annotations = False  # types are in the signature
toc_object_entries = False

html_theme = "furo"
html_title = f"orient-eye {__version__}"
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {"top_of_page_buttons": []}

linkcheck_anchors = False  # pages that are made in the browser have none
