"""The workbench: a page in a browser in which scenes are drawn, run, watched and measured (extra ``workbench``)."""
