"""Sphinx configuration: pages are MyST Markdown, and every code cell is run when the site is built."""

from __future__ import annotations

import atexit
import logging
import os
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).parent / "_ext"))
# Kernels with a profile of their own: no start-up file of the user's, and no chatter.
_profiles = TemporaryDirectory()
atexit.register(_profiles.cleanup)
os.environ["IPYTHONDIR"] = _profiles.name
os.environ["PYDEVD_DISABLE_FILE_VALIDATION"] = "1"
(Path(_profiles.name) / "profile_default").mkdir()
(Path(_profiles.name) / "profile_default" / "ipython_kernel_config.py").write_text(
    'c.IPKernelApp.log_level = "ERROR"\n'
)
logging.getLogger("traitlets").setLevel(logging.WARNING)

import elusive

project = "elusive"
author = "The elusive developers"
copyright = "2026, the elusive developers"
release = version = elusive.__version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "fields"]
exclude_patterns = ["_build", "jupyter_execute", "_ext"]
myst_enable_extensions = ["colon_fence", "deflist", "fieldlist"]
myst_heading_anchors = 3
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_in_temp = True
nb_execution_timeout = 120
nb_execution_show_tb = True
nb_output_stderr = "error"
nb_merge_streams = True

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_class_signature = "separated"
autodoc_type_aliases = {"Array": "Array"}
autodoc_preserve_defaults = True
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
napoleon_attr_annotations = False

html_theme = "furo"
html_title = "elusive"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_show_sourcelink = False
templates_path: list[str] = []
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#c2410c", "color-brand-content": "#9a3412"},
    "dark_css_variables": {"color-brand-primary": "#fb923c", "color-brand-content": "#fdba74"},
}
