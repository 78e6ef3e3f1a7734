"""Sphinx configuration of the documentation, which ``tools/docs.py`` builds."""

from importlib.metadata import version as version_of

project = "voxdisplay"
author = "The voxdisplay authors"
version = release = version_of("voxdisplay")
html_title = f"voxdisplay {version}"

extensions = ["myst_parser", "numpydoc", "sphinx.ext.autodoc", "sphinx.ext.autosummary"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["_templates"]
templates_path = ["_templates"]
default_role = "code"  # docstrings mark names by single backticks
smartquotes = False  # keys and messages are quoted as they are

myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 4
highlight_language = "none"

autosummary_generate = True
autodoc_typehints = "none"  # types stand in the docstrings, in the words of numpydoc
autodoc_member_order = "bysource"
numpydoc_show_class_members = False  # the template of the class lists them
numpydoc_class_members_toctree = False

html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["voxdisplay.css"]
html_copy_source = False
html_show_sourcelink = False
html_show_search_summary = False  # would be fetched, which browsers refuse at file://
pygments_style = "friendly"
pygments_dark_style = "monokai"
